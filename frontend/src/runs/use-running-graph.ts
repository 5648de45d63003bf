/** The graph that a run has, as it was sent last; null until it is known or when nothing runs. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { queryKeys, type Version } from "../api/graphs";
import { fetchJson } from "../api/http";
import type { Run } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import type { Graph } from "../graph/model";

export function useRunningGraph(run: Run | null): { seq: number; graph: Graph } | null {
  const goes = run !== null && run.ended_at === null;
  const version = useQuery({
    queryKey: queryKeys.version(run?.version ?? ""),
    queryFn: ({ signal }) =>
      fetchJson<Version>(`/api/versions/${encodeURIComponent(run?.version ?? "")}`, { signal }),
    enabled: goes && run.version !== null,
    staleTime: Number.POSITIVE_INFINITY,
  }).data;
  return useMemo(
    () => (goes && version ? { seq: version.seq, graph: fromUmrf(version.umrf) } : null),
    [goes, version],
  );
}
