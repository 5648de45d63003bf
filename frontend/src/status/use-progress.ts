/** Progress of a run for React: the same map as before while nothing in it has changed. */
import { useRef } from "react";
import type { Run } from "../api/runs";
import { type Progress, progressAt, progressByAid } from "./progress";
import { type GraphInRun, progressInside } from "./progress-inside";

export type ProgressByAid = ReadonlyMap<string, Progress>;

function keptProgress(before: ProgressByAid, now: ProgressByAid): ProgressByAid {
  if (before.size !== now.size) return now;
  for (const [key, progress] of now) if (before.get(key) !== progress) return now;
  return before;
}

/** `at`: the moment at which a replay stands, ms. `inside`: what is shown is a graph inside of the run's. */
export function useProgress(
  run: Run | null,
  unsure: boolean,
  at: number | null = null,
  inside: GraphInRun | null = null,
): ProgressByAid {
  const last = useRef<ProgressByAid>(new Map());
  const found =
    run === null || inside === null
      ? progressByAid(run, unsure)
      : progressInside(run, unsure, inside);
  const now = progressAt(found, at);
  last.current = keptProgress(last.current, now);
  return last.current;
}
