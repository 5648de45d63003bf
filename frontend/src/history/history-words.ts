/** Describes entries of the history of a document in a few words. Pure. */

import { authorName, type VersionAuthor } from "../api/graphs";
import type { HistoryEntry } from "../api/history";
import { isolated } from "../words/isolated";

const DONE: Readonly<Record<HistoryEntry["kind"], string>> = {
  created: "made it",
  imported: "imported it",
  edited: "changed it",
  restored: "went back",
  reverted: "took changes back",
  adapted: "took parameters over",
  merged: "merged a draft",
  published: "kept a version",
  deleted: "deleted it",
  recovered: "brought it back",
};

type Done = Pick<HistoryEntry, "kind" | "version" | "adapted" | "merged">;
type MergedIn = NonNullable<HistoryEntry["merged"]>;

/** Returns names in words, as `Ben and Mari` or `Ben, Mari and 2 others`. */
export function namesWords(people: readonly VersionAuthor[]): string {
  const names = people.map((person) => isolated(authorName(person)));
  if (names.length > 3) return `${names.slice(0, 2).join(", ")} and ${names.length - 2} others`;
  const last = names.pop() ?? "nobody";
  return names.length === 0 ? last : `${names.join(", ")} and ${last}`;
}

function mergedWords({ draft, name, source, authors }: MergedIn): string {
  const who = namesWords(authors);
  return source === draft
    ? `merged the draft “${isolated(name)}” by ${isolated(who)}`
    : `took over what ${isolated(who)} did`;
}

export function doneWords({ kind, version, adapted, merged }: Done): string {
  if (merged) return mergedWords(merged);
  if (adapted) return `took parameters of ${isolated(adapted.action)} over`;
  return kind === "published" && version?.label
    ? `kept version ${isolated(version.label)}`
    : DONE[kind];
}

const EDITS: ReadonlySet<HistoryEntry["kind"]> = new Set([
  "edited",
  "restored",
  "reverted",
  "adapted",
  "merged",
]);

/** The moment before it, with which it is compared; null where there was nothing. */
export function momentBefore({ kind, seq, from_seq }: HistoryEntry): number | null {
  if (!EDITS.has(kind)) return null;
  const before = (from_seq ?? seq) - 1;
  return before >= 1 ? before : null;
}

/**
 * Return whether an entry leads to another moment than the one before it: only then it can be
 * restored.
 */
export function isWayBack(entry: HistoryEntry, now: number): boolean {
  return entry.seq >= 1 && entry.seq < now;
}
