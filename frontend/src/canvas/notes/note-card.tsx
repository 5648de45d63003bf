/** A note or a frame on the canvas, with its text field, colours, and edges to resize it. */
import { ActionIcon } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { type NodeProps, NodeResizer, NodeToolbar, Position } from "@xyflow/react";
import { createContext, memo, use, useEffect, useRef } from "react";
import { type NewNote, NOTE_COLORS, type Note } from "../../graph/edit/notes";
import { useDraft } from "../../ui/drafts";
import { keyOf } from "../../ui/keys";
import { Tooltip } from "../../ui/tooltip";
import { ChangeTag, useChangeMark } from "../marks/change-marks";
import { FoldButton } from "./note-buttons";
import style from "./note-card.module.css";
import type { NoteNode } from "./note-nodes";
import { noteColor } from "./note-nodes";
import { LinkNames, NoteText } from "./note-text";

/** Functions that change notes; without them notes are read-only. */
export interface NoteEditing {
  /** The key of the note whose text is being edited. */
  readonly editing: string | null;
  /** The key of the only selected element. */
  readonly alone: string | null;
  edit(key: string | null): void;
  /** Changes a note. Returns false if it no longer exists. */
  change(key: string, change: Partial<NewNote>): boolean;
  /** Called while the edges of a note are dragged, and with null when that ends. */
  resizing(note: Note | null): void;
  remove(key: string): void;
}

export const NoteEditingContext = createContext<NoteEditing | null>(null);

/** The field in which the text of a note or the title of a frame is edited. */
export function NoteField({ note, notes }: { note: Note; notes: NoteEditing }) {
  const field = useRef<HTMLTextAreaElement>(null);
  useEffect(() => {
    field.current?.focus({ preventScroll: true });
    field.current?.select();
  }, []);
  const draft = useDraft({
    of: note.key,
    value: note.text,
    onCommit: (text) => notes.change(note.key, { text }),
    onLeaving: true,
  });
  const done = () => {
    draft.leave();
    notes.edit(null);
  };
  return (
    <>
      <textarea
        ref={field}
        className={`${style.field} nodrag nopan nowheel`}
        aria-label={note.kind === "frame" ? "Title of the frame" : "Text of the note"}
        defaultValue={note.text}
        maxLength={5_000}
        rows={note.kind === "frame" ? 1 : undefined}
        onInput={(event) => draft.change(event.currentTarget.value)}
        onBlur={done}
        onKeyDown={(event) => {
          event.stopPropagation();
          const key = keyOf(event);
          const ends = key === "Enter" && (note.kind === "frame" || event.ctrlKey || event.metaKey);
          if (key !== "Escape" && !ends) return;
          event.preventDefault();
          const card = event.currentTarget.closest<HTMLElement>(".react-flow__node");
          done();
          card?.focus({ preventScroll: true });
        }}
      />
      {note.kind === "note" && <LinkNames field={field} />}
    </>
  );
}

interface ToolsProps {
  note: Note;
  notes: NoteEditing;
  /** px above the note that its tools must not cover. */
  above?: number;
}

/** The colours and the delete button above a selected note. */
export function NoteTools({ note, notes, above = 10 }: ToolsProps) {
  return (
    <NodeToolbar
      isVisible={notes.alone === note.key}
      position={Position.Top}
      offset={above}
      style={{ zIndex: 1200 }}
    >
      <div className={style.tools} role="toolbar" aria-label="Colour">
        {NOTE_COLORS.map((color) => (
          <Tooltip key={color} label={color}>
            <button
              type="button"
              className={style.color}
              style={{ "--c": noteColor[color] } as React.CSSProperties}
              aria-label={color}
              aria-pressed={note.color === color}
              onClick={() => notes.change(note.key, { color })}
            />
          </Tooltip>
        ))}
        <Tooltip label="Delete">
          <ActionIcon aria-label="Delete the note" onClick={() => notes.remove(note.key)}>
            <IconTrash size={16} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </div>
    </NodeToolbar>
  );
}

function NoteWords({ note, empty }: { note: Note; empty: string }) {
  if (note.text === "") return <span data-empty>{empty}</span>;
  return note.kind === "frame" ? <span>{note.text}</span> : <NoteText text={note.text} />;
}

export const NoteCard = memo(function NoteCard({ data, selected }: NodeProps<NoteNode>) {
  const notes = use(NoteEditingContext);
  const { note } = data;
  const editing = notes?.editing === note.key;
  const empty = note.kind === "frame" ? "Frame" : "Note";
  const change = useChangeMark(note.key);
  return (
    <div
      className={style.note}
      data-kind={note.kind}
      data-change={change?.change}
      data-selected={selected || undefined}
      style={{ "--c": noteColor[note.color] } as React.CSSProperties}
    >
      {change && <ChangeTag mark={change} />}
      {notes && <NoteTools note={note} notes={notes} above={note.kind === "frame" ? 36 : 10} />}
      {notes && (
        <NodeResizer
          isVisible={selected && notes.alone === note.key}
          minWidth={60}
          minHeight={note.kind === "frame" ? 80 : 32}
          handleClassName={style.handle ?? ""}
          lineClassName={style.line ?? ""}
          onResize={(_, { x, y, width, height }) =>
            notes.resizing({ ...note, at: [x, y], size: [width, height] })
          }
          onResizeEnd={(_, { x, y, width, height }) => {
            const box = [x, y, width, height].map(Math.round) as [number, number, number, number];
            notes.resizing(null);
            notes.change(note.key, { at: [box[0], box[1]], size: [box[2], box[3]] });
          }}
        />
      )}
      {/* biome-ignore lint/a11y/noStaticElementInteractions: double click repeats what Enter does */}
      <div
        data-title
        className={`${style.text} ${selected ? "nowheel" : ""}`}
        onDoubleClick={() => notes?.edit(note.key)}
      >
        {note.kind === "frame" && <FoldButton note={note} folded={false} />}
        {editing && notes ? (
          <NoteField note={note} notes={notes} />
        ) : (
          <NoteWords note={note} empty={empty} />
        )}
      </div>
    </div>
  );
});
