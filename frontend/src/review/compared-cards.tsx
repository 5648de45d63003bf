/** Two runs on one canvas: a row for each in every card, and the flag where they part. */

import { ReactFlowProvider } from "@xyflow/react";
import { useCallback, useMemo } from "react";
import type { Comparison } from "../api/review";
import type { Run } from "../api/runs";
import { CardStateContext } from "../canvas/action-card";
import { fromUmrf } from "../canvas/from-umrf";
import { GraphView } from "../canvas/graph-view";
import { STATE_LETTER } from "../canvas/zoom-detail";
import type { Tone } from "../status/progress";
import { useProgress } from "../status/progress-inside";
import { useUnsure } from "../status/silence";
import { StateLabel, toneColor } from "../status/state-label";
import { isolated } from "../words/isolated";
import style from "./compare-page.module.css";
import { type ActionSummary, comparedActions, outermostAid, rangeText } from "./differences";

const MOST = 4; // outcomes in a row; the rest are counted

interface RowProps {
  number: number;
  ghost: boolean;
  summary: ActionSummary | null;
}

function RunRow({ number, ghost, summary }: RowProps) {
  const results = (summary?.results ?? [])
    .map((result, visit) => ({ result: result as Tone, visit }))
    .slice(-MOST);
  const often = (summary?.results.length ?? 0) > 1;
  const more = (summary?.results.length ?? 0) - results.length;
  return (
    <span className={style.runRow}>
      <b data-ghost={ghost || undefined}>{number}</b>
      <Sign summary={summary} />
      {summary === null ? (
        <span className={style.none}>did not run</span>
      ) : (
        <>
          {more > 0 && <span className={style.none}>{more} +</span>}
          {results.map(({ result, visit }) => (
            <StateLabel key={visit} still tone={result} word={often ? "" : result} />
          ))}
          <span>{rangeText(summary.took)}</span>
          {summary.said !== undefined && (
            <span className={style.none}>{often ? `${summary.said} by word` : "by word"}</span>
          )}
        </>
      )}
    </span>
  );
}

/** The last result as one character, for zooms at which words are too small. */
function Sign({ summary }: { summary: ActionSummary | null }) {
  const tone = (summary?.results.at(-1) ?? "idle") as Tone;
  return (
    <i className={style.sign} style={{ color: toneColor[tone] }} aria-hidden>
      {summary === null ? "–" : STATE_LETTER[tone]}
    </i>
  );
}

interface Props {
  found: Comparison;
  /** The second run, whole. */
  run: Run;
  selected: string | null;
  onSelect: (aid: string | null) => void;
}

export function ComparedCanvas({ found, run, selected, onSelect }: Props) {
  const graph = useMemo(() => fromUmrf(run.umrf), [run.umrf]);
  const progress = useProgress(run, useUnsure(run));
  const actions = useMemo(
    () => new Map(comparedActions(found).map((each) => [each.aid, each])),
    [found],
  );
  const ghosts = useMemo(
    () =>
      new Map(
        [...actions].flatMap(([aid, each]) => {
          const last = each.a?.results.at(-1);
          return aid === null || last === undefined ? [] : [[aid, last] as const];
        }),
      ),
    [actions],
  );
  const parting = found.parting ? outermostAid(found, found.parting.step) : null;
  const stateOf = useCallback(
    (aid: string) => {
      const action = actions.get(aid);
      return (
        <span className={style.rows}>
          {aid === parting && (
            <span className={style.flag}>
              1<span> · first difference{found.parting?.step.levels.length ? ", inside" : ""}</span>
            </span>
          )}
          <RunRow number={found.b.number} ghost={false} summary={action?.b ?? null} />
          <RunRow number={found.a.number} ghost summary={action?.a ?? null} />
        </span>
      );
    },
    [actions, parting, found],
  );
  const picked = useMemo(() => new Set(selected === null ? [] : [selected]), [selected]);
  return (
    <ReactFlowProvider>
      <CardStateContext value={stateOf}>
        <GraphView
          graph={graph}
          progress={progress}
          selected={picked}
          ghosts={ghosts}
          onSelect={onSelect}
          label={`Runs ${found.b.number} and ${found.a.number} of ${isolated(found.b.graph_name)}`}
        />
      </CardStateContext>
    </ReactFlowProvider>
  );
}

export function Legend({ found }: { found: Comparison }) {
  return (
    <p className={style.legend}>
      <b>{found.b.number}</b> this run <b data-ghost>{found.a.number}</b> ghost · strong arrows as
      run {found.b.number} took them, dotted ones as only run {found.a.number} did
    </p>
  );
}
