/** Which two moments are compared, and how a moment is called. Pure. */
import type { HistoryEntry } from "../../api/documents/history";
import type { PastPlace } from "../../edit-actions/editor-context";
import { day, hourMinute, instant } from "../../ui/times";
import { type GoodRun, goodBefore } from "../told/good-runs";
import { entryAt } from "../told/timeline";

export interface ComparedMoments {
  /** Null: nothing is compared. */
  readonly from: number | null;
  readonly to: number;
}

/** The moment before the sitting to which a change belongs; null where there is none, or it is not known. */
function beginning(entries: readonly HistoryEntry[], at: number): number | null {
  const { from_seq } = entryAt(entries, at) ?? {};
  return from_seq === undefined || from_seq < 2 ? null : from_seq - 1;
}

export interface KnownMoments {
  readonly entries: readonly HistoryEntry[];
  readonly goods: readonly GoodRun[];
  /** The moments of runs, by their id, as far as those were started with versions of this graph. */
  readonly runs: ReadonlyMap<string, number>;
}

function otherMoment({ at, with: other }: PastPlace, known: KnownMoments, newest: number) {
  if (typeof other === "number") return other;
  if (other === "nothing") return null;
  if (other === "now") return newest;
  if (other === "own") return beginning(known.entries, at);
  if (other === "good") return goodBefore(known.goods, at)?.seq ?? beginning(known.entries, at);
  return known.runs.get(other.slice("run/".length)) ?? null;
}

/** The later one is drawn, whichever of them was chosen first. */
export function momentsOf(place: PastPlace, known: KnownMoments, newest: number): ComparedMoments {
  const { at } = place;
  const other = otherMoment(place, known, newest);
  if (other === null || other === at) return { from: null, to: at };
  return { from: Math.min(at, other), to: Math.max(at, other) };
}

/** `Ada · today 14:02`: of whose sitting a moment is; its number where that is not known. */
export function momentWords(entries: readonly HistoryEntry[], at: number, now: number): string {
  const entry = entryAt(entries, at) ?? entries.find(({ seq }) => seq === at);
  const when = instant(entry?.until);
  if (entry === undefined || when === null) return `change ${at}`;
  return `${entry.author.name || "somebody"} · ${day(when, now)} ${hourMinute(when)}`;
}
