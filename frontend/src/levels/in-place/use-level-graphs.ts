/** The graphs of the server that are drawn inside of actions, as they are now. */
import { keepPreviousData, useQueries } from "@tanstack/react-query";
import { useMemo } from "react";
import { queryKeys, useGraphs } from "../../api/graphs";
import { errorText, fetchJson } from "../../api/http";
import { fromUmrf } from "../../canvas/from-umrf";
import type { Graph } from "../../graph/model";

const read = (umrf: unknown): Graph => fromUmrf(umrf);

/** Each as a graph, as words when it cannot be had, or null while it is on its way. What did not change
 * is the same object as before. */
export function useLevelGraphs(ids: readonly string[]): ReadonlyMap<string, Graph | string | null> {
  const { data: graphs } = useGraphs();
  const found = useQueries({
    queries: ids.map((id) => {
      // The list tells of every change; without it, it is asked for once.
      const seq = graphs?.find((graph) => graph.id === id)?.seq ?? 0;
      const path = `/api/graphs/${encodeURIComponent(id)}/umrf?identities=true`;
      return {
        queryKey: [...queryKeys.graph(id), "umrf", seq],
        queryFn: ({ signal }: { signal: AbortSignal }) => fetchJson<unknown>(path, { signal }),
        placeholderData: keepPreviousData,
        select: read,
      };
    }),
    combine: (results) =>
      results.map(({ data, error }) => data ?? (error ? errorText(error) : null)),
  });
  return useMemo(() => new Map(ids.map((id, i) => [id, found[i] ?? null])), [ids, found]);
}
