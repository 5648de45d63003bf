/** The history as one list by time: what people did, versions and runs, day by day. Pure. */

import { useInfiniteQuery, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import { useVersions, type Version } from "../api/graphs";
import { fetchHistory, type HistoryEntry, wentWell } from "../api/history";
import { newestRun } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { type ListedRun, listRuns, NO_FILTER } from "../api/review";
import type { Run } from "../api/runs";
import { type AgedRun, newerFirst } from "../api/sites";
import { useThrottledLink } from "../sync/use-room";
import { instant } from "../ui/times";

export type TimelineItem =
  | { readonly kind: "entry"; readonly at: number; readonly entry: HistoryEntry }
  | { readonly kind: "run"; readonly at: number; readonly run: ListedRun };

export interface TimelineDay {
  /** The last moment of it that is told: what it is called is for who shows it. */
  readonly at: number;
  readonly items: readonly TimelineItem[];
}

/** Stays the same while somebody goes on with what it tells. */
export function entryKey({ kind, author, at }: HistoryEntry): string {
  return `${kind} ${author.id} ${at}`;
}

/** Return whether an entry is a part of a known one: an entry may be cut where a page ends. */
function isPartOf(entry: HistoryEntry, known: HistoryEntry): boolean {
  if (entryKey(entry) === entryKey(known)) return true;
  if (entry.from_seq === undefined || known.from_seq === undefined) return false;
  const within = known.from_seq <= entry.seq && entry.seq <= known.seq;
  return entry.author.id === known.author.id && within;
}

/** Pages of the history, newest first, as one list. */
export function joined(pages: readonly (readonly HistoryEntry[])[]): HistoryEntry[] {
  const all: HistoryEntry[] = [];
  for (const page of pages) {
    const before = [...all];
    for (const entry of page) {
      if (!before.some((known) => isPartOf(entry, known))) all.push(entry);
    }
  }
  return all;
}

/** The change before which the next page is asked for; null where there is none. */
export function nextPage(page: readonly HistoryEntry[], limit: number): number | null {
  if (page.length < limit) return null;
  // Versions and the like tell the moment that they are about, which may be long ago.
  return (page.findLast(({ from_seq }) => from_seq !== undefined) ?? page.at(-1))?.seq ?? null;
}

/**
 * Returns entries of the history and runs in one list, newest first. `whole`: there is nothing older; else runs from
 * before what is told wait for it.
 */
export function timelineOf(
  entries: readonly HistoryEntry[],
  runs: readonly ListedRun[],
  whole: boolean,
): TimelineItem[] {
  const items: TimelineItem[] = entries.map((entry) => ({
    kind: "entry",
    at: instant(entry.until) ?? 0,
    entry,
  }));
  const oldest = items.at(-1)?.at ?? 0;
  for (const run of runs) {
    const at = instant(run.started_at) ?? instant(run.requested_at) ?? 0;
    if (whole || at >= oldest) items.push({ kind: "run", at, run });
  }
  return items.sort((a, b) => b.at - a.at);
}

/** The change after which a graph was at some time; null where that is not known for certain. */
export function momentAt(entries: readonly HistoryEntry[], time: number): number | null {
  let found: number | null = null;
  for (const { at, until, from_seq, seq } of entries) {
    if (from_seq === undefined) continue;
    const [begun, ended] = [instant(at), instant(until)];
    if (begun === null || ended === null || begun > time) continue;
    if (ended > time) return null;
    found = Math.max(found ?? 0, seq);
  }
  return found;
}

const dayOf = (at: number): number => new Date(at).setHours(0, 0, 0, 0);

export function daysOf(items: readonly TimelineItem[]): TimelineDay[] {
  const days = new Map<number, TimelineItem[]>();
  for (const item of items) {
    const day = dayOf(item.at);
    days.set(day, [...(days.get(day) ?? []), item]);
  }
  return [...days.values()].map((all) => ({ at: all[0]?.at ?? 0, items: all }));
}

/** The sitting to which a change belongs, or that it ends. */
export function entryAt(entries: readonly HistoryEntry[], seq: number): HistoryEntry | null {
  const edits = entries.filter(({ from_seq }) => from_seq !== undefined);
  const ended = edits.find((entry) => entry.seq === seq);
  return ended ?? edits.find(({ from_seq = 0, seq: end }) => from_seq <= seq && seq <= end) ?? null;
}

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
  /** Runs that went well, the last one at the end. */
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

/** A run that went well, and the moment of what it was started with. */
export interface GoodRun {
  readonly run: number;
  readonly seq: number;
}

type EndedRun = AgedRun & Pick<Run, "version" | "state" | "result">;

/**
 * Return the runs that went well and were started with a known version, the last one at the end.
 */
export function goodRuns(
  runs: readonly EndedRun[],
  versions: readonly Pick<Version, "id" | "seq">[],
): GoodRun[] {
  const seqOf = new Map(versions.map(({ id, seq }) => [id, seq]));
  return runs
    .filter(wentWell)
    .sort((a, b) => newerFirst(b, a))
    .flatMap(({ number: run, version }) => {
      const seq = seqOf.get(version ?? "");
      return seq === undefined ? [] : [{ run, seq }];
    });
}

/** The last one that was started with something before a moment. `goods` are in the order of runs. */
export function goodBefore(goods: readonly GoodRun[], at: number): GoodRun | null {
  return goods.findLast(({ seq }) => seq < at) ?? null;
}
