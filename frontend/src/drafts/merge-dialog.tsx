/** A merge before it is made: what changes, what both changed with a choice, and problems that come along. */
import { Button, Modal, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import {
  type DraftChoices,
  type DraftSide,
  type GraphDraft,
  type MergePreview,
  mergeDraft,
  useMergePreview,
} from "../api/documents/drafts";
import { refreshHistory } from "../api/documents/history";
import { errorText } from "../api/http";
import { CoursesOfText } from "../courses/courses-told";
import { namesWords } from "../history/history-words";
import { isolated } from "../words/isolated";
import style from "./drafts.module.css";
import { MergeConflicts } from "./merge-conflicts";
import { MergeProblems } from "./merge-problems";
import { isNothing, ToldChanges } from "./told-changes";
import { useDraftStep } from "./use-draft-step";

interface Props {
  draft: GraphDraft;
  into: DraftSide;
  onClose: () => void;
}

/** The choices that were made, of conflicts that are still there. */
function useChoices() {
  const [choices, setChoices] = useState<DraftChoices>({});
  const choose = (place: string, side: DraftSide) => setChoices({ ...choices, [place]: side });
  return { choices, choose };
}

function useMerge({ draft, into, onClose }: Props) {
  const client = useQueryClient();
  const { busy, wrong, step } = useDraftStep();
  const merge = (found: MergePreview, choices: DraftChoices) =>
    step(async () => {
      const { seq, draft_seq } = found;
      const { graph, changed } = await mergeDraft(draft.id, { into, seq, draft_seq, choices });
      await refreshHistory(client, graph);
      onClose();
      notifications.show({
        title: into === "origin" ? `“${isolated(draft.name)}” is merged` : "Taken over",
        message: changed ? "The history leads back." : "Everything stays as it was.",
      });
    });
  return { busy, wrong, merge };
}

function Intro({ found, draft, into }: Props & { found: MergePreview }) {
  const into_name =
    into === "origin" ? draft.origin_name || "the graph" : `“${isolated(draft.name)}”`;
  if (isNothing(found.changes)) return <p>As it is chosen, nothing changes.</p>;
  return (
    <p>
      What <bdi>{namesWords(found.authors)}</bdi> did comes into <bdi>{into_name}</bdi>:
    </p>
  );
}

function Body(props: Props) {
  const { draft, into, onClose } = props;
  const { choices, choose } = useChoices();
  const found = useMergePreview(draft.id, into, choices);
  const { busy, wrong, merge } = useMerge(props);
  if (found.isPending) return <Skeleton height={200} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  const { conflicts, changes, problems, seq, draft_seq } = found.data;
  const seen = `${seq} ${draft_seq}`;
  const left = conflicts.filter(({ place }) => choices[place] === undefined).length;
  const names = { origin: draft.origin_name || "the graph", draft: `“${isolated(draft.name)}”` };
  return (
    <div className={style.merge} aria-busy={found.isFetching}>
      {conflicts.length > 0 && (
        <MergeConflicts {...{ conflicts, choices, names }} onChoose={choose} />
      )}
      <section aria-label="What changes">
        <Intro {...props} found={found.data} />
        <ToldChanges changes={changes} nothing="" />
      </section>
      <MergeProblems problems={problems} />
      {into === "origin" && (
        <CoursesOfText graph={draft.origin} umrf={found.data.umrf} of={[draft.id, seen, choices]} />
      )}
      {wrong !== "" && (
        <p className={style.wrong} role="alert">
          {wrong}
        </p>
      )}
      <div className={style.answers}>
        <Button onClick={onClose}>Cancel</Button>
        <Button
          variant="filled"
          loading={busy}
          disabled={left > 0 || found.isFetching}
          onClick={() => void merge(found.data, choices)}
        >
          {left > 0 ? `Choose ${left} more` : into === "origin" ? "Merge" : "Take over"}
        </Button>
      </div>
    </div>
  );
}

export function MergeDialog(props: Props) {
  const { draft, into, onClose } = props;
  const origin = <bdi>{draft.origin_name || "the graph"}</bdi>;
  const title =
    into === "origin" ? (
      <>
        Merge “<bdi>{draft.name}</bdi>” into {origin}
      </>
    ) : (
      <>Take over what {origin} has meanwhile</>
    );
  return (
    <Modal opened onClose={onClose} size="xl" title={title}>
      <Body {...props} />
    </Modal>
  );
}
