/** The graph that a run was started with, which may differ from the graph on screen. */
import { useQuery } from "@tanstack/react-query";
import { useLayoutEffect, useMemo } from "react";
import { fetchVersion, queryKeys } from "../api/graphs";
import type { Run } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import type { Graph } from "../graph/model";
import type { ProgressByAid } from "../status/progress-inside";
import { withWaits } from "../status/waits";

/** Return the version that a run was started with; null until it is known, and for a run that is over. */
export function useSentGraph(run: Run | null): { seq: number; graph: Graph } | null {
  const goes = run !== null && run.ended_at === null;
  const version = useQuery({
    queryKey: queryKeys.version(run?.version ?? ""),
    queryFn: ({ signal }) => fetchVersion(run?.version ?? "", signal),
    enabled: goes && run.version !== null,
    staleTime: Number.POSITIVE_INFINITY,
  }).data;
  return useMemo(
    () => (goes && version ? { seq: version.seq, graph: fromUmrf(version.umrf) } : null),
    [goes, version],
  );
}

/** Progress in which actions that wait for another robot say so, and the progress it was made of. */
export interface Waits {
  readonly of: ProgressByAid;
  readonly progress: ProgressByAid;
}

interface Props {
  run: Run;
  progress: ProgressByAid;
  onWaits: (waits: Waits) => void;
}

/** Completes the progress on the canvas, by the arrows that were sent. Renders nothing. */
export function RunWaits({ run, progress, onWaits }: Props) {
  const graph = useSentGraph(run)?.graph ?? null;
  useLayoutEffect(
    () => onWaits({ of: progress, progress: withWaits(graph, progress) }),
    [graph, progress, onWaits],
  );
  return null;
}
