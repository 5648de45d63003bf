/** What was done to a document, in a few words. Pure. */
import type { HistoryEntry } from "../api/documents/history";

const DONE: Readonly<Record<HistoryEntry["kind"], string>> = {
  created: "made it",
  imported: "imported it",
  edited: "changed it",
  restored: "went back",
  reverted: "took changes back",
  adapted: "took parameters over",
  published: "kept a version",
  deleted: "deleted it",
  recovered: "brought it back",
};

type Done = Pick<HistoryEntry, "kind" | "version" | "adapted">;

export function doneWords({ kind, version, adapted }: Done): string {
  if (adapted) return `took parameters of ${adapted.action} over`;
  return kind === "published" && version?.label ? `kept version ${version.label}` : DONE[kind];
}

const EDITS: ReadonlySet<HistoryEntry["kind"]> = new Set([
  "edited",
  "restored",
  "reverted",
  "adapted",
]);

/** The moment before it, with which it is compared; null where there was nothing. */
export function momentBefore({ kind, seq, from_seq }: HistoryEntry): number | null {
  if (!EDITS.has(kind)) return null;
  const before = (from_seq ?? seq) - 1;
  return before >= 1 ? before : null;
}

/** Those that lead to another moment than the one after which they come: only they can be gone back to. */
export function isWayBack(entry: HistoryEntry, now: number): boolean {
  return entry.seq >= 1 && entry.seq < now;
}
