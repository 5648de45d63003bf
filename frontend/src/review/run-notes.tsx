/** Notes at moments of a run: written beside its events, and drawn on its axis. */
import { Button, Group, Textarea } from "@mantine/core";
import { useQueryClient } from "@tanstack/react-query";
import { useRef, useState } from "react";
import { authorName } from "../api/graphs";
import { errorText } from "../api/http";
import { usePerson } from "../api/people";
import { addRunNote, notesKey, type RunNote } from "../api/run-notes";
import type { Run } from "../api/runs";
import { serverNow } from "../clock/server-clock";
import type { TimeSign } from "../status/lanes/timeline";
import { announcer } from "../ui/announcer";
import { textScope, useKeptText } from "../ui/kept-texts";
import { keyOf } from "../ui/keys";
import { instant, stopwatch } from "../ui/times";
import { isolated } from "../words/isolated";

/** Return a note as a line of the events. */
export function noteText(note: Pick<RunNote, "author" | "text">): string {
  return `${isolated(authorName(note.author))} noted: “${note.text}”`;
}

export function noteSigns(notes: readonly RunNote[]): TimeSign[] {
  return notes.flatMap((note) => {
    const at = instant(note.moment);
    return at === null ? [] : [{ at, tone: "run", text: noteText(note), note: true }];
  });
}

interface Props {
  runner: string | undefined;
  run: Run;
  /** The moment that is shown, ms; null for the end, or now. */
  at: number | null;
}

/** A button that opens a field for a note at the moment that is shown. */
export function NoteHere({ runner, run, at }: Props) {
  // The moment stays while somebody writes, also where the run or the replay goes on.
  const [moment, setMoment] = useState<number | null | undefined>(undefined);
  const button = useRef<HTMLButtonElement>(null);
  const close = () => {
    setMoment(undefined);
    requestAnimationFrame(() => button.current?.focus());
  };
  if (moment !== undefined && runner !== undefined)
    return <NoteForm {...{ runner, run, moment }} onClose={close} />;
  const isOver = run.ended_at !== null;
  return (
    <Button
      ref={button}
      size="compact-sm"
      variant="default"
      disabled={runner === undefined}
      onClick={() => setMoment(at ?? (isOver ? null : serverNow()))}
    >
      Note
    </Button>
  );
}

interface FormProps {
  runner: string;
  run: Run;
  moment: number | null;
  onClose: () => void;
}

function NoteForm({ runner, run, moment, onClose }: FormProps) {
  const client = useQueryClient();
  const { person } = usePerson();
  const [text, setText] = useKeptText(`${textScope(`run ${run.id}`, person.id)}note`);
  const [wrong, setWrong] = useState("");
  const [busy, setBusy] = useState(false);
  const save = async () => {
    setBusy(true);
    try {
      const at = moment === null ? null : new Date(moment).toISOString();
      const notes = await addRunNote(runner, run.id, { text, moment: at });
      client.setQueryData(notesKey(run.id), notes);
      void client.invalidateQueries({ queryKey: ["runs", "list"] });
      setText("");
      announcer.say("Noted.");
      onClose();
    } catch (error) {
      setWrong(errorText(error));
      setBusy(false);
    }
  };
  const start = instant(run.started_at) ?? instant(run.requested_at) ?? 0;
  const when = moment === null ? "the end" : stopwatch(Math.max(0, moment - start));
  return (
    <form
      className="stack gap-40 w-full"
      onSubmit={(event) => {
        event.preventDefault();
        void save();
      }}
      onKeyDown={(event) => {
        if (keyOf(event) === "Escape") onClose();
      }}
    >
      <Textarea
        label={`Note at ${when}`}
        autosize
        minRows={2}
        maxRows={8}
        maxLength={2000}
        autoFocus
        value={text}
        error={wrong || undefined}
        onChange={(event) => setText(event.currentTarget.value)}
      />
      <Group gap="sm">
        <Button size="compact-sm" onClick={onClose}>
          Cancel
        </Button>
        <Button
          size="compact-sm"
          variant="filled"
          type="submit"
          loading={busy}
          disabled={text.trim() === ""}
        >
          Save note
        </Button>
      </Group>
    </form>
  );
}
