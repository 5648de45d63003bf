/** What a run was started with, beside the graph with which it is compared. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { fetchJson } from "../../api/http";
import { useLive } from "../../api/live/use-live";
import { umrfUrl } from "../../api/review";
import { fromUmrf } from "../../canvas/from-umrf";
import type { Graph } from "../../graph/model";
import { alignedWith } from "./aligned";

/** Null while there is nothing to show. `run`: null, where none is wanted. */
export function useRunGraph(run: string | null, other: Graph | null) {
  const { runner } = useLive();
  const found = useQuery({
    enabled: run !== null && runner !== undefined,
    queryKey: ["runs", "umrf", run],
    queryFn: ({ signal }) => fetchJson<unknown>(umrfUrl(runner ?? "", run ?? ""), { signal }),
    staleTime: Number.POSITIVE_INFINITY,
  });
  const { data } = found;
  const graph = useMemo(
    () => (run === null || data === undefined || other === null ? null : read(data, other)),
    [run, data, other],
  );
  return { graph, error: run === null ? null : found.error };
}

const read = (umrf: unknown, other: Graph): Graph => alignedWith(fromUmrf(umrf), other);
