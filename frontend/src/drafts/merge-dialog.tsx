/** A merge before it is made: what changes, what both changed with a choice, and problems that come along. */
import { Button, Modal, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconAlertTriangle } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useId, useState } from "react";
import {
  type DraftChoices,
  type DraftConflict,
  type DraftSide,
  type GraphDraft,
  type MergePreview,
  mergeDraft,
  useMergePreview,
} from "../api/drafts";
import type { Problem } from "../api/graphs";
import { refreshHistory } from "../api/history";
import { errorText } from "../api/http";
import { CoursesOfText } from "../courses/courses-told";
import { ChangeLines } from "../history/entry-row";
import { namesWords } from "../history/history-words";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import { useDraftStep } from "./draft-steps";
import style from "./drafts.module.css";

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
        message: changed ? "To go back, use the history." : "Nothing changed.",
      });
    });
  return { busy, wrong, merge };
}

function Intro({ found, draft, into }: Props & { found: MergePreview }) {
  const into_name =
    into === "origin" ? draft.origin_name || "the graph" : `“${isolated(draft.name)}”`;
  if (isNothing(found.changes)) return <p>With these choices, nothing changes.</p>;
  return (
    <p>
      Changes of <bdi>{namesWords(found.authors)}</bdi> come into <bdi>{into_name}</bdi>:
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

interface ConflictSideProps {
  conflict: DraftConflict;
  side: DraftSide;
  name: string;
  group: string;
  chosen: boolean;
  onChoose: () => void;
}

function Side({ conflict, side, name, group, chosen, onChoose }: ConflictSideProps) {
  return (
    <label className={style.side} data-chosen={chosen || undefined}>
      <span className={style.pick}>
        <input type="radio" name={group} checked={chosen} onChange={onChoose} />
        <bdi>{name}</bdi>
      </span>
      {conflict.removed === side ? (
        <p className="m-0 ink-error">removed it</p>
      ) : (
        <ToldChanges changes={conflict[side]} nothing="changed it" />
      )}
    </label>
  );
}

interface MergeConflictsProps {
  conflicts: readonly DraftConflict[];
  choices: DraftChoices;
  names: Readonly<Record<DraftSide, string>>;
  onChoose: (place: string, side: DraftSide) => void;
}

export function MergeConflicts({ conflicts, choices, names, onChoose }: MergeConflictsProps) {
  const group = useId();
  return (
    <section aria-label="Changed on both sides">
      <h3>
        Both changed {conflicts.length === 1 ? "this" : `these ${conflicts.length}`}: whose counts?
      </h3>
      {conflicts.map((conflict) => (
        <fieldset key={conflict.place} className={style.conflict}>
          <legend>
            <bdi>{conflict.what}</bdi>
          </legend>
          <div className={style.sides}>
            {(["origin", "draft"] as const).map((side) => (
              <Side
                key={side}
                conflict={conflict}
                side={side}
                name={names[side]}
                group={`${group} ${conflict.place}`}
                chosen={choices[conflict.place] === side}
                onChoose={() => onChoose(conflict.place, side)}
              />
            ))}
          </div>
        </fieldset>
      ))}
    </section>
  );
}

export function MergeProblems({ problems }: { problems: readonly Problem[] }) {
  if (problems.length === 0) return <p className={style.quiet}>The merge brings no problem.</p>;
  return (
    <section aria-label="Problems that the merge brings">
      <h3>The merge brings {counted(problems.length, "problem")}</h3>
      <ul className={style.problems}>
        {problems.map((problem) => (
          <li
            key={`${problem.code} ${problem.where.path} ${problem.message}`}
            data-severity={problem.severity}
          >
            <IconAlertTriangle size={14} aria-label={problem.severity} />
            <span>{problem.message}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}

const MOST = 12; // lines

type ToldMerge = MergePreview["changes"];

export const isNothing = ({ fields, actions, relations, notes }: ToldMerge): boolean =>
  [fields, actions, relations, notes].every((each) => (each?.length ?? 0) === 0);

interface ToldChangesProps {
  changes: ToldMerge;
  /** Text for no changes. */
  nothing: string;
}

export function ToldChanges({ changes, nothing }: ToldChangesProps) {
  if (isNothing(changes)) return <p className={style.quiet}>{nothing}</p>;
  return (
    <div className={style.told}>
      <ChangeLines changes={changes} most={MOST} />
    </div>
  );
}

const NO_CHOICES = {};

function Compared({ draft }: { draft: GraphDraft }) {
  const found = useMergePreview(draft.id, "origin", NO_CHOICES);
  if (found.isPending) return <Skeleton height={160} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  const { draft_did, origin_did, conflicts } = found.data;
  return (
    <>
      <div className={style.sides}>
        <section>
          <h3>In this draft</h3>
          <ToldChanges changes={draft_did} nothing="Nothing was changed." />
        </section>
        <section>
          <h3>
            Meanwhile in <bdi>{draft.origin_name || "the graph"}</bdi>
          </h3>
          <ToldChanges changes={origin_did} nothing="Nothing was changed." />
        </section>
      </div>
      {conflicts.length > 0 && (
        <p className={style.quiet}>
          Both changed {conflicts.map(({ what }) => what).join(", ")}. A merge asks which value to
          keep.
        </p>
      )}
    </>
  );
}

export function CompareDialog({ draft, onClose }: { draft: GraphDraft; onClose: () => void }) {
  return (
    <Modal opened onClose={onClose} size="xl" title={<bdi>{draft.name}</bdi>}>
      <Compared draft={draft} />
      <div className={style.answers}>
        <Button onClick={onClose}>Close</Button>
      </div>
    </Modal>
  );
}
