/** A folded frame: one block with its title, the number of actions in it, and their states. */

import { Handle, type NodeProps, Position } from "@xyflow/react";
import { memo, use } from "react";
import { toneColor } from "../../status/state-label";
import { counted } from "../../words/counted";
import { ProblemBadge } from "../marks/problem-marks";
import { FoldButton, FoldFrameContext } from "../notes/note-buttons";
import { NoteEditingContext, NoteField, NoteTools } from "../notes/note-card";
import type { FoldedNode, FrameBlock } from "../notes/note-nodes";
import { noteColor } from "../notes/note-nodes";
import { OUTCOMES } from "../outcome";
import { STATE_LETTER } from "../zoom-detail";
import style from "./folded-frame.module.css";

/** React Flow attaches arrows to these invisible handles; the router chooses where lines really end. */
function Ports({ direction }: Pick<FrameBlock, "direction">) {
  const right = direction === "right";
  const [into, out] = right ? [Position.Left, Position.Right] : [Position.Top, Position.Bottom];
  const still = { className: style.port ?? "", isConnectable: false };
  return (
    <>
      <Handle {...still} type="target" id="in" position={into} />
      {OUTCOMES.map((outcome) => (
        <Handle {...still} key={outcome} type="source" id={outcome} position={out} />
      ))}
    </>
  );
}

function States({ states }: Pick<FrameBlock, "states">) {
  return (
    <p className={style.states}>
      {states.map(({ word, tone, count }, i) => (
        <span key={word}>
          {i > 0 && " · "}
          <span data-tone={tone} style={tone === "idle" ? {} : { color: toneColor[tone] }}>
            {STATE_LETTER[tone] && <span aria-hidden>{STATE_LETTER[tone]} </span>}
            {count} {word}
          </span>
        </span>
      ))}
    </p>
  );
}

export const FoldedFrame = memo(function FoldedFrame({ data, selected }: NodeProps<FoldedNode>) {
  const notes = use(NoteEditingContext);
  const fold = use(FoldFrameContext);
  const { note, block } = data;
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: double click repeats what the button does
    <div
      className={style.block}
      style={{ "--c": noteColor[note.color] } as React.CSSProperties}
      data-selected={selected || undefined}
      data-tone={block.tone ?? undefined}
      onDoubleClick={() => fold?.(note.key, false)}
    >
      {notes && <NoteTools note={note} notes={notes} above={20} />}
      {block.mark && <ProblemBadge mark={block.mark} on="card" />}
      <div className={style.title} data-title>
        <FoldButton note={note} folded />
        {notes?.editing === note.key ? (
          <NoteField note={note} notes={notes} />
        ) : (
          <b className={style.name}>{note.text || "Frame"}</b>
        )}
      </div>
      <p className={style.count}>{counted(block.actions, "action")}</p>
      {block.states.length > 0 && <States states={block.states} />}
      <Ports direction={block.direction} />
    </div>
  );
});
