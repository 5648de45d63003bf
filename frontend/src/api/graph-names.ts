/** The names of graphs: of all, and of one in the lists that the page has loaded. */
import {
  type InfiniteData,
  type QueryClient,
  useQuery,
  useQueryClient,
} from "@tanstack/react-query";
import { useMemo } from "react";
import { editor } from "./client";
import type { GraphPage } from "./graph-list";
import { queryKeys } from "./graphs";
import type { EditorApi } from "./schema/editor";

export type GraphName = EditorApi["GraphName"];

const namesQuery = {
  queryKey: queryKeys.names,
  queryFn: ({ signal }: { signal?: AbortSignal }) => editor.get("/api/graphs/names", { signal }),
} as const;

/** The names of all graphs, sorted. */
export function useGraphNames() {
  return useQuery(namesQuery);
}

/** Return the names of all graphs as they are now. */
export function fetchGraphNames(client: QueryClient): Promise<readonly GraphName[]> {
  return client.fetchQuery({ ...namesQuery, staleTime: 0, retry: false });
}

/** Return the name of a graph in the lists that the page has loaded; undefined if it is in none. */
export function useListedName(id: string): string | undefined {
  const client = useQueryClient();
  return useMemo(() => {
    const lists = client.getQueriesData<InfiniteData<GraphPage>>({ queryKey: queryKeys.pages });
    const all = lists.flatMap(([, data]) => data?.pages?.flatMap(({ graphs }) => graphs) ?? []);
    return all.find((graph) => graph.id === id)?.name;
  }, [client, id]);
}
