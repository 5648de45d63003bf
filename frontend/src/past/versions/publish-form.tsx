/** Publishes what is shown as a version with a name and a note. */
import { Button, Textarea, TextInput } from "@mantine/core";
import { IconFlag } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { refreshHistory } from "../../api/documents/history";
import { publishNamed } from "../../api/documents/versions";
import { queryKeys } from "../../api/graphs";
import { errorText } from "../../api/http";
import { usePerson } from "../../api/use-person";
import { CoursesAt } from "../../courses/courses-told";
import { useEditorContext } from "../../edit-actions/editor-context";
import { useThrottledLink } from "../../sync/use-room";
import { textScope, useKeptText } from "../../ui/drafts/kept-texts";
import style from "./versions.module.css";

const LABEL_LIMIT = 200; // letters
const NOTE_LIMIT = 4_000;

/** Why what is shown cannot be published now; null when it can. */
function useObstacle(): string | null {
  const { past } = useEditorContext();
  const { state, unsaved, seq } = useThrottledLink();
  if (past !== null) return null; // that is stored
  if (state !== "live" || seq === 0) return "The server is not there now.";
  return unsaved > 0 ? "Saving what was changed …" : null;
}

interface FieldsProps {
  onPublished: (seq: number) => void;
  onClose: () => void;
}

function Fields({ onPublished, onClose }: FieldsProps) {
  const { id, past } = useEditorContext();
  const link = useThrottledLink();
  const client = useQueryClient();
  const [label, setLabel] = useState("");
  const { person } = usePerson();
  const [note, setNote] = useKeptText(`${textScope(id, person.id)}version`);
  const [busy, setBusy] = useState(false);
  const [refused, setRefused] = useState("");
  const obstacle = useObstacle();
  const seq = past?.at ?? link.seq;
  const publish = async (event: FormEvent) => {
    event.preventDefault();
    if (obstacle !== null || busy) return;
    setBusy(true);
    try {
      await publishNamed(id, { label, note, seq });
      await client.invalidateQueries({ queryKey: queryKeys.versions(id) });
      void refreshHistory(client, id);
      onPublished(seq);
      setNote("");
      onClose();
    } catch (error) {
      setRefused(errorText(error));
      setBusy(false);
    }
  };
  const cancel = () => {
    setNote("");
    onClose();
  };
  return (
    <form className={style.form} onSubmit={(event) => void publish(event)}>
      <TextInput
        label="Name"
        placeholder="before the steam leak"
        maxLength={LABEL_LIMIT}
        value={label}
        autoFocus
        onChange={(event) => setLabel(event.currentTarget.value)}
      />
      <Textarea
        label="Note"
        placeholder="What is to be known of it"
        autosize
        minRows={2}
        maxRows={8}
        maxLength={NOTE_LIMIT}
        value={note}
        onChange={(event) => setNote(event.currentTarget.value)}
      />
      {obstacle === null && <CoursesAt graph={id} seq={seq} />}
      {(refused || obstacle) && <p role={refused ? "alert" : "status"}>{refused || obstacle}</p>}
      <div className={style.buttons}>
        <Button size="compact-sm" variant="default" onClick={cancel}>
          Cancel
        </Button>
        <Button
          size="compact-sm"
          type="submit"
          variant="filled"
          loading={busy}
          disabled={obstacle !== null}
        >
          Publish
        </Button>
      </div>
    </form>
  );
}

export function PublishForm() {
  const { id, past, mayGoBack } = useEditorContext();
  const [open, setOpen] = useState(false);
  const [published, setPublished] = useState<number | null>(null);
  if (!mayGoBack) return null;
  if (open) return <Fields onPublished={setPublished} onClose={() => setOpen(false)} />;
  return (
    <div className={style.publish}>
      <Button
        fullWidth
        size="compact-sm"
        variant="light"
        leftSection={<IconFlag size={14} aria-hidden />}
        onClick={() => setOpen(true)}
      >
        {past === null ? "Publish a version …" : "Publish this moment …"}
      </Button>
      {published !== null && <CoursesAt graph={id} seq={published} />}
    </div>
  );
}
