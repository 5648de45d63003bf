/** Shows the numbers of errors, values to fill in and warnings of a graph, and opens their list. */
import { IconAlertTriangle, IconPencil } from "@tabler/icons-react";
import { useEffect, useMemo, useRef } from "react";
import { useProblems } from "../api/graphs";
import { useEditorStore } from "../canvas/editor-store";
import { problemMarksOf } from "../canvas/marks/problem-marks";
import { useEditorContext } from "../edit-actions/editor-context";
import type { Graph } from "../graph/model";
import { type ProblemGroup, problemGroups } from "../graph/problems/problem-groups";
import { countsOf } from "../graph/problems/problem-kinds";
import style from "./problem-count.module.css";

/**
 * Return the problems of a moment with the graph's names, as a list and as marks. Problems of an
 * older moment are described with the graph of their arrival.
 */
export function useProblemGroups(id: string, seq: number, graph: Graph) {
  const problems = useProblems(id, seq).data;
  const now = useRef(graph);
  now.current = graph;
  const found = problems?.problems;
  const told = useMemo(() => problemGroups(found ?? [], now.current), [found]);
  const marks = useMemo(() => problemMarksOf(told), [told]);
  const store = useEditorStore();
  useEffect(() => store.problems.set(told), [store, told]);
  return { problems, told, marks };
}

/** Return the counts of problems that block a start, in words; empty if none does. */
export function blockWords(told: readonly ProblemGroup[]): string {
  const { wrong, fillIn } = countsOf(told.filter(({ blocks }) => blocks));
  return [
    ...(wrong > 0 ? [`${wrong} wrong`] : []),
    ...(fillIn > 0 ? [`${fillIn} to fill in`] : []),
  ].join(", ");
}

export function ProblemCount({ told }: { told: readonly ProblemGroup[] }) {
  const { setPanel } = useEditorContext();
  const { wrong, fillIn, warnings } = countsOf(told);
  if (wrong + fillIn + warnings === 0) return null;
  const blocks = blockWords(told);
  return (
    <button
      type="button"
      className={style.counts}
      onClick={() => setPanel("problems")}
      title={blocks === "" ? "No problem prevents a start" : `${blocks}: this prevents a start`}
    >
      {wrong > 0 && (
        <span className={style.count} data-kind="wrong">
          <IconAlertTriangle size={13} aria-hidden /> {wrong} <span>wrong</span>
        </span>
      )}
      {fillIn > 0 && (
        <span className={style.count} data-kind="fill-in">
          <IconPencil size={13} aria-hidden /> {fillIn} <span>to fill in</span>
        </span>
      )}
      {warnings > 0 && (
        <span className={style.count} data-kind="warning">
          <IconAlertTriangle size={13} aria-hidden /> {warnings}{" "}
          <span>{warnings === 1 ? "warning" : "warnings"}</span>
        </span>
      )}
    </button>
  );
}
