/** The history of a graph, its versions and its runs, as they are loaded and renewed. */
import { useInfiniteQuery, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import { fetchHistory, type HistoryEntry } from "../../api/documents/history";
import { useVersions, type Version } from "../../api/graphs";
import { newestRun } from "../../api/live/open-runs";
import { useLive } from "../../api/live/use-live";
import { type ListedRun, listRuns, NO_FILTER } from "../../api/review";
import { useThrottledLink } from "../../sync/use-room";
import { type GoodRun, goodRuns } from "./good-runs";
import { joined, nextPage, type TimelineItem, timelineOf } from "./timeline";

const PAGE = 40; // entries
const RUNS = 200;
const RENEWED = 1_200; // ms after the last edit: a sitting that goes on is not read with each key

const NONE: readonly never[] = [];

export interface Timeline {
  readonly entries: readonly HistoryEntry[];
  readonly items: readonly TimelineItem[];
  readonly versions: readonly Version[];
  /** Its newest runs, the newest first. */
  readonly runs: readonly ListedRun[];
  /** There are more of them. */
  readonly moreRuns: boolean;
  /** Those that went well, the last one last. */
  readonly goods: readonly GoodRun[];
  readonly lastGood: GoodRun | null;
  readonly isPending: boolean;
  readonly error: Error | null;
  readonly hasOlder: boolean;
  readonly isLoadingOlder: boolean;
  loadOlder(): void;
}

/** The newest runs of a graph. */
function useRunsOf(id: string) {
  const { runner, now } = useLive();
  const newest = newestRun(now, id);
  return useQuery({
    enabled: runner !== undefined,
    queryKey: ["runs", "of", id, "history", newest?.id ?? "", newest?.state ?? ""],
    queryFn: ({ signal }) =>
      listRuns(runner ?? "", { ...NO_FILTER, graph: id }, null, RUNS, signal),
    placeholderData: (before) => before,
  });
}

function usePages(id: string, moment: string) {
  const client = useQueryClient();
  const pages = useInfiniteQuery({
    queryKey: ["history", id, "pages"],
    queryFn: ({ pageParam, signal }) => fetchHistory(id, PAGE, pageParam, signal),
    initialPageParam: null as number | null,
    getNextPageParam: (page) => nextPage(page, PAGE),
  });
  // biome-ignore lint/correctness/useExhaustiveDependencies: read again when something was done
  useEffect(() => {
    const renew = () => void client.invalidateQueries({ queryKey: ["history", id, "pages"] });
    const timer = setTimeout(renew, RENEWED);
    return () => clearTimeout(timer);
  }, [client, id, moment]);
  return pages;
}

export function useTimeline(id: string): Timeline {
  const { seq } = useThrottledLink();
  const { data: versions = NONE } = useVersions(id);
  const pages = usePages(id, `${seq} ${versions.length}`);
  const { data: runs = NONE } = useRunsOf(id);
  const { data, hasNextPage, isFetchingNextPage, fetchNextPage } = pages;
  const entries = useMemo(() => joined(data?.pages ?? NONE), [data]);
  const items = useMemo(
    () => timelineOf(entries, runs, !hasNextPage),
    [entries, runs, hasNextPage],
  );
  const goods = useMemo(() => goodRuns(runs, versions), [runs, versions]);
  return {
    entries,
    items,
    versions,
    runs,
    moreRuns: runs.length >= RUNS,
    goods,
    lastGood: goods.at(-1) ?? null,
    isPending: pages.isPending,
    error: pages.error,
    hasOlder: hasNextPage,
    isLoadingOlder: isFetchingNextPage,
    loadOlder: () => {
      if (hasNextPage && !isFetchingNextPage) void fetchNextPage();
    },
  };
}
