/** A note or a frame as a form: what the canvas shows, without a pointer. */
import { Button } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { useRef } from "react";
import { noteColor } from "../canvas/notes/note-nodes";
import { isMarkedUp, LinkNames, NoteText } from "../canvas/notes/note-text";
import { useEditorContext } from "../edit-actions/editor-context";
import { removeNotes } from "../graph/edit";
import { changeNote, NOTE_COLORS, type Note, type NoteColor } from "../graph/edit/notes";
import { withLinkIds } from "../graph/note-links";
import { DraftInput } from "../ui/draft-input";
import { SharedField } from "./fields/shared-field";
import style from "./inspector.module.css";

const LEAST = { width: 60, height: 32 }; // px, as it is read
const MOST = 20_000; // px

function fits(least: number) {
  return (draft: string): string | null =>
    /^\d{1,5}$/.test(draft) && Number(draft) >= least && Number(draft) <= MOST
      ? null
      : `A whole number from ${least} to ${MOST}.`;
}

function Colors({ note, onPick }: { note: Note; onPick: (color: NoteColor) => void }) {
  const { mayEdit } = useEditorContext();
  return (
    <fieldset className={style.colors}>
      <legend>Colour</legend>
      {NOTE_COLORS.map((color) => (
        <label key={color} style={{ "--c": noteColor[color] } as React.CSSProperties}>
          <input
            type="radio"
            name={`color of ${note.key}`}
            checked={note.color === color}
            disabled={!mayEdit}
            onChange={() => onPick(color)}
          />
          {color}
        </label>
      ))}
    </fieldset>
  );
}

export function NoteForm({ note }: { note: Note }) {
  const { doc, graph, select } = useEditorContext();
  const frame = note.kind === "frame";
  const change = (part: Parameters<typeof changeNote>[2]) => changeNote(doc, note.key, part);
  const [width, height] = note.size;
  const area = useRef<HTMLTextAreaElement>(null);
  return (
    <div className={style.form} data-form={note.key}>
      <SharedField of={note.key} field="text">
        <DraftInput
          label={frame ? "Title" : "Text"}
          lines={!frame}
          area={area}
          value={note.text}
          placeholder={frame ? "What lies in it" : "What others shall know"}
          check={(draft) => (draft.length > 5_000 ? "At most 5000 characters." : null)}
          onCommit={(text) => change({ text: frame ? text : withLinkIds(text, graph.actions) })}
        />
        {!frame && <LinkNames field={area} />}
      </SharedField>
      {!frame && isMarkedUp(note.text) && (
        <div
          className={style.readNote}
          style={{ "--c": noteColor[note.color] } as React.CSSProperties}
        >
          <NoteText text={note.text} />
        </div>
      )}
      <Colors note={note} onPick={(color) => change({ color })} />
      <div className={style.pair}>
        <DraftInput
          label="Width"
          value={String(Math.round(width))}
          inputMode="decimal"
          check={fits(LEAST.width)}
          onCommit={(text) => change({ size: [Number(text), height] })}
        />
        <DraftInput
          label="Height"
          value={String(Math.round(height))}
          inputMode="decimal"
          check={fits(frame ? 80 : LEAST.height)}
          onCommit={(text) => change({ size: [width, Number(text)] })}
        />
      </div>
      <p className="m-0 ink2">
        {frame
          ? "Moving a frame moves what lies in it. Engines ignore frames."
          : "Markdown. [[Drive 0]] links to the action of that name, also after it is renamed. Engines ignore notes."}
      </p>
      <Button
        leftSection={<IconTrash size={14} />}
        color="red"
        variant="subtle"
        onClick={() => {
          removeNotes(doc, [note.key.slice(2)]);
          select([]);
        }}
      >
        {frame ? "Delete this frame" : "Delete this note"}
      </Button>
    </div>
  );
}
