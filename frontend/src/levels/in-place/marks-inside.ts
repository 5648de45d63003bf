/** What is wrong in graphs that are drawn inside of others: marks for what is drawn there. */
import { useSyncExternalStore } from "react";
import { toldOnCanvas } from "../../canvas/graphs-inside";
import {
  type ProblemMark,
  type ProblemMarks,
  problemMarksOf,
} from "../../canvas/marks/problem-marks";
import type { ToldProblem } from "../../graph/problems/told-problems";

let last: { told: readonly ToldProblem[]; marks: ProblemMarks } | null = null;

/** By the keys of the actions that lead there and of what it is at, joined by "/": each level says what is
 * wrong below it. */
export function marksInside(told: readonly ToldProblem[]): ProblemMarks {
  if (last?.told === told) return last.marks;
  const each = told.flatMap((one) => {
    const { inside } = one.problems[0];
    if (inside === undefined) return [];
    const { aid } = inside.where ?? {};
    const way = aid === undefined ? inside.aids : [...inside.aids, aid];
    return way.slice(1).map((_, i) => ({
      ...{ ...one, code: inside.code, message: inside.message },
      place: way.slice(0, i + 2).join("/"),
    }));
  });
  last = { told, marks: problemMarksOf(each) };
  return last.marks;
}

export function useMarkInside(path: string): ProblemMark | undefined {
  const { subscribe, now } = toldOnCanvas;
  return useSyncExternalStore(subscribe, () => marksInside(now()).get(path));
}
