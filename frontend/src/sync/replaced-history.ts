/**
 * Detects that a server's document does not continue the history that this page knows, and keeps the waiting edits
 * as values.
 *
 * A restored backup lacks entries that it had acknowledged or sent. Merging into it blindly would
 * bring them back against the wish of whoever restored it; so the page stops, and the person
 * decides about the edits that wait.
 */

import * as Y from "yjs";
import {
  endsOf,
  type Maps,
  mapsFrom,
  mapsOf,
  ROOTS,
  type Root,
  rootOf,
  splitKey,
} from "../graph/document-keys";
import { asOneEdit } from "../graph/edit/document-writes";
import { ENTRY, EXIT } from "../graph/model";
import { isEqual } from "../graph/values";
import type { ReplacedEntries, StoredCopy, UnsavedEdit } from "./indexed-db";

/** Plain values by key; `undefined` where the key is erased. */
export type DocumentDifference = { readonly [R in Root]: ReadonlyMap<string, unknown> };

/** Edits that wait and that the server does not take as they are. */
export interface StrandedEdits {
  /** The reason of the server's refusal; absent where the server has another history, from a backup. */
  readonly refused?: "not-accepted" | "full";
  readonly edits: number;
  /** The time at which the last of them was made, in milliseconds since 1970. */
  readonly at: number;
  /** The values that they gave, by key. */
  readonly difference: DocumentDifference;
  /** The values that the first of them found there, as far as they are known. */
  readonly before: DocumentDifference;
  /** The graph on this page, with these edits. */
  readonly here: Maps;
}

/** Records the values that the person's edits replace, while the document still has them. */
export class ReplacedValues {
  private readonly doc: Y.Doc;
  private readonly ignore: unknown;
  private found: [Root, string, unknown][] = [];
  private readonly watched: readonly (readonly [Root, (event: Y.YMapEvent<unknown>) => void])[];

  /** Ignores transactions whose origin is `ignore`. */
  constructor(doc: Y.Doc, ignore: unknown) {
    this.doc = doc;
    this.ignore = ignore;
    this.watched = ROOTS.map((root) => [root, (event) => this.see(root, event)] as const);
    for (const [root, see] of this.watched) rootOf(doc, root).observe(see);
  }

  /** Returns what was replaced since the last call. */
  take(): ReplacedEntries {
    const found = this.found;
    this.found = [];
    return found;
  }

  close(): void {
    for (const [root, see] of this.watched) rootOf(this.doc, root).unobserve(see);
  }

  private see(root: Root, { transaction, changes }: Y.YMapEvent<unknown>): void {
    if (!transaction.local || transaction.origin === this.ignore) return;
    for (const [key, { oldValue }] of changes.keys) this.found.push([root, key, oldValue]);
  }
}

/** Returns the edits of a copy that was kept on the device, as `strandedEditsIn` does. */
export function strandedEditsOf({
  known,
  waiting,
}: Pick<StoredCopy, "known" | "waiting">): StrandedEdits {
  const doc = new Y.Doc();
  for (const update of known) Y.applyUpdate(doc, update);
  const before = mapsOf(doc);
  for (const { update } of waiting) Y.applyUpdate(doc, update);
  return strandedEditsIn(doc, waiting, before);
}

/**
 * Returns true if a server with this state vector lacks something that was durable when the page last heard from
 * it.
 */
export function lacksKnownEdits(
  doc: Y.Doc,
  waiting: readonly UnsavedEdit[],
  server: Uint8Array,
): boolean {
  const known = Y.decodeStateVector(Y.encodeStateVector(doc));
  for (const { update } of waiting) {
    for (const [client, clock] of Y.parseUpdateMeta(update).from) {
      known.set(client, Math.min(known.get(client) ?? 0, clock));
    }
  }
  const theirs = Y.decodeStateVector(server);
  return [...known].some(([client, clock]) => (theirs.get(client) ?? 0) < clock);
}

/** Returns what the waiting edits changed in the document. `base` is the document before all of them. */
export function strandedEditsIn(
  doc: Y.Doc,
  waiting: readonly UnsavedEdit[],
  base?: Maps,
): StrandedEdits {
  const difference = mutable();
  for (const root of ROOTS) rootOf(doc, root); // makes them maps, also where nobody has looked yet
  for (const { update } of waiting) {
    const { structs, ds } = Y.decodeUpdate(update);
    for (const { id, length } of structs) note(doc, difference, id.client, id.clock, length);
    for (const [client, ranges] of ds.clients) {
      for (const { clock, len } of ranges) note(doc, difference, client, clock, len);
    }
  }
  const before = mutable();
  for (const [root, key, value] of waiting.flatMap((edit) => edit.before ?? [])) {
    if (!before[root].has(key)) before[root].set(key, value);
  }
  for (const root of base === undefined ? [] : ROOTS) {
    for (const key of difference[root].keys()) {
      if (!before[root].has(key)) before[root].set(key, base?.[root].get(key));
    }
  }
  for (const root of ROOTS) {
    for (const [key, value] of before[root]) {
      // Made and taken back again.
      if (difference[root].has(key) && isEqual(difference[root].get(key), value)) {
        difference[root].delete(key);
      }
    }
  }
  const edits = waiting.length;
  return { edits, at: waiting.at(-1)?.at ?? 0, difference, before, here: mapsOf(doc) };
}

function note(
  doc: Y.Doc,
  difference: ReturnType<typeof mutable>,
  client: number,
  start: number,
  length: number,
): void {
  const structs = doc.store.clients.get(client) ?? [];
  for (const struct of structs) {
    const { clock } = struct.id;
    if (clock + struct.length <= start || clock >= start + length) continue;
    if (!(struct instanceof Y.Item) || struct.parentSub === null) continue;
    const key = struct.parentSub;
    const root = ROOTS.find((name) => struct.parent === rootOf(doc, name));
    if (root !== undefined) difference[root].set(key, rootOf(doc, root).get(key));
  }
}

/** Returns the values to set or erase so that `before` becomes `after`. */
export function differenceOf(before: Y.Doc, after: Y.Doc): DocumentDifference {
  const [old, now] = [mapsOf(before), mapsOf(after)];
  const difference = mutable();
  for (const root of ROOTS) {
    for (const [key, value] of now[root]) {
      if (!isEqual(value, old[root].get(key))) difference[root].set(key, value);
    }
    for (const key of old[root].keys()) {
      if (!now[root].has(key)) difference[root].set(key, undefined);
    }
  }
  return difference;
}

/**
 * Makes the same changes as one new edit. Changes that belong to missing actions are left out, since nobody would
 * see them. Returns the number of changed keys.
 */
export function applyDifference(doc: Y.Doc, difference: DocumentDifference): number {
  const fits = fitting(doc, difference);
  let changed = 0;
  asOneEdit(doc, () => {
    for (const root of ROOTS) {
      const map = rootOf(doc, root);
      for (const [key, value] of difference[root]) {
        if (!fits(root, key, value)) continue;
        if (value === undefined ? !map.has(key) : isEqual(map.get(key), value)) continue;
        if (value === undefined) map.delete(key);
        else map.set(key, value);
        changed += 1;
      }
    }
  });
  return changed;
}

/** Returns true if none of these changes belongs to an action that is missing. */
export function fitsWhole(doc: Y.Doc, difference: DocumentDifference): boolean {
  const fits = fitting(doc, difference);
  return ROOTS.every((root) =>
    [...difference[root]].every(([key, value]) => fits(root, key, value)),
  );
}

type Fits = (root: Root, key: string, value: unknown) => boolean;

function fitting(doc: Y.Doc, difference: DocumentDifference): Fits {
  const actions = rootOf(doc, "actions");
  const lives = (aid: string) =>
    difference.actions.has(aid) ? difference.actions.get(aid) !== undefined : actions.has(aid);
  const isEnd = (key: string) => key === ENTRY || key === EXIT || lives(key);
  const belongs = (root: Root, { head, rest }: { head: string; rest: string }) => {
    if (root === "actions") return rest === "" || lives(head);
    const ends = root === "relations" ? endsOf(head) : null;
    return ends === null || (isEnd(ends.parent) && isEnd(ends.child));
  };
  return (root, key, value) => value === undefined || belongs(root, splitKey(key));
}

function mutable(): { readonly [R in Root]: Map<string, unknown> } {
  return mapsFrom({}) as { readonly [R in Root]: Map<string, unknown> };
}
