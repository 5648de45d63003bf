/** The breakpoints that a start of a moment names. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { fetchDocument } from "../../api/history";
import { fetchBreakpointsInside } from "../../api/inside";
import { type RunBreakpoint, startBreakpoints } from "../../graph/breakpoints";
import { mapsFrom } from "../../graph/document-keys";
import { readGraph } from "../../graph/read";

const AGAIN = 5_000; // ms

/** Query where a led run of this moment waits, as it was drawn then. */
export function useBreakpoints(graph: string, seq: number) {
  return useQuery({
    queryKey: ["breakpoints", graph, seq],
    queryFn: async ({ signal }) => {
      const document = await fetchDocument(graph, seq, signal);
      return startBreakpoints(readGraph(mapsFrom(document)));
    },
    staleTime: Number.POSITIVE_INFINITY,
  });
}

/**
 * Return the breakpoints `own` of a graph with those inside of the sub-graphs that a start `opens`, as these are
 * now; undefined until all are known. `version`: of the run that it continues.
 */
export function useAllBreakpoints(
  own: readonly RunBreakpoint[] | undefined,
  graph: string,
  seq: number,
  opens: boolean,
  version: string | undefined,
): { breakpoints: readonly RunBreakpoint[] | undefined; error: Error | null } {
  const { data, error } = useQuery({
    queryKey: ["breakpoints inside", graph, seq, version],
    queryFn: ({ signal }) => fetchBreakpointsInside(graph, seq, version, signal),
    enabled: opens,
    refetchInterval: AGAIN,
    staleTime: 0,
    gcTime: 0,
  });
  const all = useMemo(() => own && data && [...own, ...data], [own, data]);
  if (!opens) return { breakpoints: own, error: null };
  return { breakpoints: error === null ? all : undefined, error };
}
