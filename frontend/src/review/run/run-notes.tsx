/** What people note about a run: a pin, labels, a note. */
import { ActionIcon, Button, TagsInput, Textarea } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconPin, IconPinFilled } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { errorText } from "../../api/http";
import { type RunMarks, setMarks, useLabels, useMarks } from "../../api/review";
import { useDraft } from "../../ui/drafts/use-draft";
import style from "./run-notes.module.css";

/** The marks of a run and a way to change them, shown at once and taken back if refused. */
function useEditedMarks(runner: string | undefined, run: string) {
  const client = useQueryClient();
  const marks = useMarks(runner, run);
  const change = async (part: Partial<RunMarks>): Promise<void> => {
    if (runner === undefined) return;
    const key = ["runs", "marks", run];
    const before = client.getQueryData<RunMarks>(key);
    if (before) client.setQueryData(key, { ...before, ...part });
    try {
      client.setQueryData(key, await setMarks(runner, run, part));
      void client.invalidateQueries({ queryKey: ["runs", "list"] });
      void client.invalidateQueries({ queryKey: ["runs", "labels"] });
    } catch (error) {
      client.setQueryData(key, before);
      notifications.show({ color: "red", title: "Not noted", message: errorText(error) });
    }
  };
  return { marks: marks.data, change };
}

export function PinRun({ runner, run }: { runner: string | undefined; run: string }) {
  const { marks, change } = useEditedMarks(runner, run);
  const pinned = marks?.pinned ?? false;
  return (
    <ActionIcon
      aria-label={pinned ? "Unpin this run" : "Pin this run"}
      aria-pressed={pinned}
      disabled={marks === undefined}
      onClick={() => void change({ pinned: !pinned })}
    >
      {pinned ? <IconPinFilled size={16} aria-hidden /> : <IconPin size={16} aria-hidden />}
    </ActionIcon>
  );
}

export function RunNotes({ runner, run }: { runner: string | undefined; run: string }) {
  const { marks, change } = useEditedMarks(runner, run);
  const known = useLabels(runner).data ?? [];
  const saved = marks?.note ?? "";
  const field = useDraft({
    value: saved,
    onCommit(note) {
      void change({ note });
      return true;
    },
    onLeaving: true,
  });
  return (
    <section className={style.notes} aria-label="Notes">
      <TagsInput
        label="Labels"
        placeholder={marks?.labels.length ? "" : "For example “demo”"}
        data={known}
        maxTags={20}
        maxLength={60}
        clearable
        disabled={marks === undefined}
        value={marks?.labels ?? []}
        onChange={(labels) => void change({ labels: labels.map((each) => each.trim()) })}
      />
      <Textarea
        label="Note"
        placeholder="What should the next person know about this run?"
        autosize
        minRows={2}
        maxLength={4000}
        disabled={marks === undefined}
        value={field.text}
        onChange={(event) => field.change(event.currentTarget.value)}
        onBlur={field.leave}
      />
      {field.text !== saved && (
        <Button size="compact-sm" onClick={field.leave}>
          Save note
        </Button>
      )}
    </section>
  );
}
