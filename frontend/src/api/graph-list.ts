/** The list of graphs by pages, as the server sorts and searches it; and the labels. */
import { keepPreviousData, useInfiniteQuery, useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { editor } from "./client";
import { type GraphSummary, queryKeys } from "./graphs";

const PAGE = 60; // graphs: a few screens of cards
const AGAIN = 8_000; // ms

/** Graphs that are wanted, in their order. */
export interface GraphsWanted {
  /** Each word stands in the name, description, robots, labels or people there. */
  readonly search?: string;
  /** The id of a folder, "" for graphs that are in none; absent: wherever they are. */
  readonly folder?: string;
  /** Also in the folders inside of it. */
  readonly deep?: boolean;
  readonly label?: string | null;
  readonly sort?: "changed" | "name" | "problems" | "size";
  /** Ids of graphs that come before the others, in this order. */
  readonly first?: readonly string[];
}

export interface GraphPage {
  readonly graphs: readonly GraphSummary[];
  readonly total: number;
}

async function fetchPage(
  { search = "", folder, deep = false, label, sort = "changed", first = [] }: GraphsWanted,
  limit: number,
  offset: number,
  signal: AbortSignal,
): Promise<GraphPage> {
  const query = new URLSearchParams({ limit: String(limit), offset: String(offset), sort });
  if (search.trim() !== "") query.set("q", search.trim());
  if (folder !== undefined) query.set("folder", folder);
  if (deep) query.set("deep", "true");
  if (label != null) query.set("label", label);
  for (const id of first) query.append("first", id);
  let total = 0;
  const onHeaders = (headers: Headers) => {
    total = Number(headers.get("x-total"));
  };
  const graphs = await editor.get("/api/graphs", { query, signal, onHeaders });
  return { graphs, total };
}

/** Return the graphs of all pages, each once: one that changed meanwhile may stand on two pages. */
function eachOnce(pages: readonly GraphPage[]): GraphSummary[] {
  const graphs = new Map<string, GraphSummary>();
  for (const page of pages) {
    for (const graph of page.graphs) if (!graphs.has(graph.id)) graphs.set(graph.id, graph);
  }
  return [...graphs.values()];
}

export interface GraphPages {
  /** Undefined until the first page is there. */
  readonly graphs: readonly GraphSummary[] | undefined;
  /** Number of graphs on all pages, also on those that are not loaded. */
  readonly total: number;
  readonly hasMore: boolean;
  readonly isLoadingMore: boolean;
  /** The graphs are those that were wanted before, until the answer is there. */
  readonly isOld: boolean;
  readonly error: Error | null;
  more(): void;
}

/** Graphs page by page, renewed as long as they are shown; many pages are renewed less often. */
export function useGraphPages(wanted: GraphsWanted): GraphPages {
  const found = useInfiniteQuery({
    queryKey: [...queryKeys.pages, wanted],
    queryFn: ({ pageParam, signal }) => fetchPage(wanted, PAGE, pageParam, signal),
    initialPageParam: 0,
    getNextPageParam: (last, pages) => {
      const offset = pages.length * PAGE;
      return last.graphs.length > 0 && offset < last.total ? offset : undefined;
    },
    placeholderData: keepPreviousData,
    refetchInterval: (query) => AGAIN * Math.max(1, query.state.data?.pages.length ?? 1),
  });
  const pages = found.data?.pages;
  const graphs = useMemo(() => pages && eachOnce(pages), [pages]);
  return {
    graphs,
    total: pages?.at(-1)?.total ?? 0,
    hasMore: found.hasNextPage,
    isLoadingMore: found.isFetchingNextPage,
    isOld: found.isPlaceholderData,
    error: found.error,
    more: () => {
      if (found.hasNextPage && !found.isFetchingNextPage) void found.fetchNextPage();
    },
  };
}

/**
 * The graphs with these ids (200 at most) as lists show them, without those that are gone; asked for again all the
 * time.
 */
export function useSomeGraphs(ids: readonly string[]) {
  const first = [...new Set(ids)].sort().slice(0, 200);
  return useQuery({
    enabled: first.length > 0,
    queryKey: [...queryKeys.pages, "some", first],
    queryFn: ({ signal }) => fetchPage({ first }, first.length, 0, signal),
    placeholderData: keepPreviousData,
    refetchInterval: AGAIN,
    select: ({ graphs }) => graphs,
  });
}

/** The labels of the graphs in a folder and those inside of it; "" for all graphs. */
export function useGraphLabels(folder: string, enabled: boolean) {
  return useQuery({
    enabled,
    queryKey: [...queryKeys.labels, folder],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/labels", { query: { folder, deep: true }, signal }),
    select: (labels) => labels.map(({ label }) => label),
  });
}
