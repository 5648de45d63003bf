/** A note or a frame as a form: what the canvas shows, without a pointer. */
import { Button } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { noteColor } from "../canvas/note-colors";
import { useEditorContext } from "../edit-actions/editor-context";
import { removeNotes } from "../graph/edit";
import { changeNote, NOTE_COLORS, type Note, type NoteColor } from "../graph/edit/notes";
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
  const { doc, select } = useEditorContext();
  const frame = note.kind === "frame";
  const change = (part: Parameters<typeof changeNote>[2]) => void changeNote(doc, note.key, part);
  const [width, height] = note.size;
  return (
    <div className={style.form}>
      <SharedField of={note.key} field="text">
        <DraftInput
          label={frame ? "Title" : "Text"}
          lines={!frame}
          value={note.text}
          placeholder={frame ? "What lies in it" : "What others shall know"}
          check={(draft) => (draft.length > 5_000 ? "At most 5000 characters." : null)}
          onCommit={(text) => change({ text })}
        />
      </SharedField>
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
      <p className={style.hint}>
        {frame
          ? "A frame takes along what lies in it. No engine reads it."
          : "Notes are for people: no engine reads them."}
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
