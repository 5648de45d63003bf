/** All versions of the open graph, the newest first, and the way to publish another one. */
import { Button, Textarea, TextInput } from "@mantine/core";
import { IconFlag } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useMemo, useState } from "react";
import { publishNamed, queryKeys } from "../api/graphs";
import { refreshHistory } from "../api/history";
import { errorText } from "../api/http";
import { usePerson } from "../api/people";
import { CoursesAt } from "../courses/courses-told";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { useThrottledLink } from "../sync/use-room";
import { textScope, useKeptText } from "../ui/kept-texts";
import { useNow } from "../ui/times";
import { momentLink, useCopyAsGraph, useGoingBack } from "./restoring";
import type { Timeline } from "./timeline";
import { type ListedVersion, listedVersions, VersionItem } from "./version-row";
import style from "./versions.module.css";

const PAGE = 50; // versions that are drawn at first

/** Return the version that is on screen: of two of the same moment, the one that was chosen. */
function useChosen({ past }: EditorContext, all: readonly ListedVersion[]) {
  const [chosen, setChosen] = useState("");
  const here = all.filter(({ version }) => version.seq === past?.at);
  const known = here.find(({ version }) => version.id === chosen) ?? here[0];
  return { shown: known?.version.id ?? "", setChosen };
}

export function VersionsList({ timeline }: { timeline: Timeline }) {
  const context = useEditorContext();
  const { id, past, lookAt, mayGoBack } = context;
  const { seq } = useThrottledLink();
  const now = useNow(60_000);
  const { versions, runs, moreRuns } = timeline;
  const all = useMemo(() => listedVersions(versions, runs), [versions, runs]);
  const { shown, setChosen } = useChosen(context, all);
  const { busy, restore } = useGoingBack(context);
  const copies = useCopyAsGraph();
  const [most, setMost] = useState(PAGE);
  const item = (listed: ListedVersion) => {
    const { version, number } = listed;
    const choose = () => {
      setChosen(version.id);
      const place = { at: version.seq, with: past?.with ?? "good" } as const;
      lookAt(shown === version.id ? null : place);
    };
    return (
      <VersionItem
        key={version.id}
        {...{ listed, now }}
        chosen={shown === version.id}
        isNow={version.seq === seq}
        link={momentLink(id, version.seq)}
        mayEdit={mayGoBack}
        busy={busy || copies.busy}
        onChoose={choose}
        onCompare={() => lookAt({ at: version.seq, with: "now" })}
        onCopy={() => void copies.copy(version.seq, number)}
        onRestore={() => void restore(version.seq)}
      />
    );
  };
  return (
    <>
      <PublishForm />
      {all.length === 0 && (
        <p className={style.empty}>
          No version yet. Each start publishes one. You can also publish one by hand, with a note.
        </p>
      )}
      <ol className="list-reset" aria-label="Versions">
        {all.slice(0, most).map(item)}
      </ol>
      {all.length > most && (
        <Button size="compact-sm" variant="subtle" onClick={() => setMost(most + PAGE)}>
          {all.length - most} older ones
        </Button>
      )}
      {moreRuns && <p className={style.empty}>Only the newest {runs.length} runs are counted.</p>}
    </>
  );
}

const LABEL_LIMIT = 200; // letters
const NOTE_LIMIT = 4_000;

/** Return why the graph on screen cannot be published now; null when it can. */
function useObstacle(): string | null {
  const { past } = useEditorContext();
  const { state, unsaved, seq } = useThrottledLink();
  if (past !== null) return null; // that is stored
  if (state !== "live" || seq === 0) return "The server does not answer now.";
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
        placeholder="What should others know about it?"
        autosize
        minRows={2}
        maxRows={8}
        maxLength={NOTE_LIMIT}
        value={note}
        onChange={(event) => setNote(event.currentTarget.value)}
      />
      {obstacle === null && <CoursesAt graph={id} seq={seq} />}
      {(refused || obstacle) && <p role={refused ? "alert" : "status"}>{refused || obstacle}</p>}
      <div className={`${style.buttons} fingers`}>
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

function PublishForm() {
  const { id, past, mayGoBack } = useEditorContext();
  const [open, setOpen] = useState(false);
  const [published, setPublished] = useState<number | null>(null);
  if (!mayGoBack) return null;
  if (open) return <Fields onPublished={setPublished} onClose={() => setOpen(false)} />;
  return (
    <div className={`${style.publish} fingers`}>
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
