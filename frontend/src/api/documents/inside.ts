/** The graphs inside of a graph, by value: what goes along with starts, looks and expected courses. */
import { useQuery } from "@tanstack/react-query";
import type { GraphSummary } from "../graphs";
import { fetchJson } from "../http";
import type { Inside } from "../runs";
import type { EditorApi } from "../schema/editor";

interface Pinned {
  subgraphs?: readonly object[] | null | undefined;
  tree_digest?: string | null | undefined;
}

/** What a version, a run or a moment has inside, as it is sent. */
export function insideOf({ subgraphs, tree_digest }: Pinned): Inside {
  if (!subgraphs?.length || !tree_digest) return {};
  return { subgraphs, tree_digest };
}

/** What is inside of a moment, as it is now. */
export async function fetchInside(
  graph: string,
  seq: number,
  signal?: AbortSignal,
): Promise<Inside> {
  const route = `/api/graphs/${encodeURIComponent(graph)}/subgraphs?at=${seq}`;
  return insideOf(await fetchJson<EditorApi["InsideView"]>(route, { ...(signal && { signal }) }));
}

const flatRoute = (graph: string): string => `/api/graphs/${encodeURIComponent(graph)}/flat`;

/** A graph and those inside of it as one graph that does the same, or why there is none. */
export type FlatGraph = EditorApi["FlatGraph"];
/** Why not, and about which action of which level. */
export type FlatteningReason = EditorApi["FlatteningReason"];

/** It is asked for anew each time: what is inside may have changed. */
export function useFlatGraph(graph: string) {
  return useQuery({
    queryKey: ["graphs", graph, "flat"],
    queryFn: ({ signal }) => fetchJson<FlatGraph>(flatRoute(graph), { signal }),
    staleTime: 0,
    gcTime: 0,
  });
}

export function makeFlatGraph(graph: string, body: EditorApi["FlatCopy"]): Promise<GraphSummary> {
  return fetchJson(flatRoute(graph), { method: "POST", body });
}
