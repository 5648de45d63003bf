/** All versions of the open graph, the newest first, and the way to publish another one. */
import { Button } from "@mantine/core";
import { useMemo, useState } from "react";
import { type EditorContext, useEditorContext } from "../../edit-actions/editor-context";
import { useThrottledLink } from "../../sync/use-room";
import { useNow } from "../../ui/times";
import type { Timeline } from "../told/use-timeline";
import { useGoingBack } from "../ways/going-back";
import { momentLink, useCopyAsGraph } from "../ways/use-copies";
import { PublishForm } from "./publish-form";
import { type ListedVersion, listedVersions } from "./version-facts";
import { VersionItem } from "./version-row";
import style from "./versions.module.css";

const PAGE = 50; // versions that are drawn at first

/** Which one is looked at: of two of the same moment the one that was chosen. */
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
          No version yet. One is published with each start, and by hand whenever there is something
          to say of it.
        </p>
      )}
      <ol className={style.list} aria-label="Versions">
        {all.slice(0, most).map(item)}
      </ol>
      {all.length > most && (
        <Button size="compact-sm" variant="subtle" onClick={() => setMost(most + PAGE)}>
          {all.length - most} older ones
        </Button>
      )}
      {moreRuns && <p className={style.empty}>Runs are counted among the newest {runs.length}.</p>}
    </>
  );
}
