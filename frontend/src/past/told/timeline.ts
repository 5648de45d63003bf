/** The history as one list by time: what people did, versions and runs, day by day. Pure. */
import type { HistoryEntry } from "../../api/documents/history";
import type { ListedRun } from "../../api/review";
import { instant } from "../../ui/times";

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

/** Whether two pages tell of the same: an entry may be cut where a page ends. */
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

/** `whole`: there is nothing older; else runs from before what is told wait for it. */
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
