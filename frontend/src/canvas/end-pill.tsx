/** Entry and exit of a graph. */
import { IconFlag, IconPlayerPlayFilled } from "@tabler/icons-react";
import { Handle, type NodeProps, Position } from "@xyflow/react";
import { memo } from "react";
import type { EndNode } from "./elements";
import style from "./end-pill.module.css";

export const EndPill = memo(function EndPill({
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
