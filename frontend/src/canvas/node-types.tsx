/** The components that draw nodes and edges of a canvas, with those of its entry and exit. */
import { IconFlag, IconPlayerPlayFilled } from "@tabler/icons-react";
import { type EdgeTypes, Handle, type NodeProps, type NodeTypes, Position } from "@xyflow/react";
import { memo } from "react";
import { ActionCard } from "./action-card";
import type { EndNode } from "./elements";
import style from "./node-types.module.css";
import { NoteCard } from "./notes/note-card";
import { OutcomeArrow } from "./outcome-arrow";
import "@xyflow/react/dist/style.css";
import "./canvas.css";

const EndPill = memo(function EndPill({
  data,
  selected,
  isConnectable,
  sourcePosition = Position.Bottom,
  targetPosition = Position.Top,
}: NodeProps<EndNode>) {
  const entry = data.end === "entry";
  return (
    <div className={style.frame} data-direction={data.direction}>
      <div className={style.pill} data-end={data.end} data-selected={selected || undefined}>
        {entry ? (
          <IconPlayerPlayFilled size={11} aria-hidden />
        ) : (
          <IconFlag size={13} aria-hidden />
        )}
        {entry ? "Entry" : "Exit"}
        <Handle
          type={entry ? "source" : "target"}
          id={entry ? "start" : "in"}
          position={entry ? sourcePosition : targetPosition}
          className={style.handle ?? ""}
          isConnectable={isConnectable}
          role="img"
          aria-label={entry ? "Start with" : "End with"}
        />
      </div>
    </div>
  );
});

export const nodeTypes: NodeTypes = { action: ActionCard, end: EndPill, note: NoteCard };
export const edgeTypes: EdgeTypes = { outcome: OutcomeArrow };
