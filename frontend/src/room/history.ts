/**
 * Whether a server's document continues the history that this page knows, and what to do when not.
 *
 * A restored backup lacks entries that it had acknowledged or sent. Merging into it blindly would
 * bring them back against the wish of whoever restored it; so the page stops, and the person
 * decides about the edits that wait.
 */

import * as Y from "yjs";
import { mapsFrom, mapsOf, ROOTS, type Root, rootOf, splitKey } from "../graph/layout";
import { together } from "../graph/pen";
import { same } from "../graph/same";
import type { Waiting } from "./device";

/** Plain values by key; `undefined` where the key is erased. */
export type Difference = { readonly [R in Root]: ReadonlyMap<string, unknown> };

/** Edits that wait, on a history that is no more the server's. */
export interface Stranded {
  readonly edits: number;
  /** When the last of them was made, in milliseconds since 1970. */
  readonly at: number;
  /** What they changed, by key, with the values that they gave. */
  readonly difference: Difference;
}

/** Whether a server with this state vector lacks something that was durable when we last heard. */
export function wentBack(doc: Y.Doc, waiting: readonly Waiting[], server: Uint8Array): boolean {
  const known = Y.decodeStateVector(Y.encodeStateVector(doc));
  for (const { update } of waiting) {
    for (const [client, clock] of Y.parseUpdateMeta(update).from) {
      known.set(client, Math.min(known.get(client) ?? 0, clock));
    }
  }
  const theirs = Y.decodeStateVector(server);
  return [...known].some(([client, clock]) => (theirs.get(client) ?? 0) < clock);
}

/** What the waiting edits changed in the document. */
export function strandedIn(doc: Y.Doc, waiting: readonly Waiting[]): Stranded {
  const difference = mutable();
  for (const root of ROOTS) rootOf(doc, root); // makes them maps, also where nobody has looked yet
  for (const { update } of waiting) {
    const { structs, ds } = Y.decodeUpdate(update);
    for (const { id, length } of structs) note(doc, difference, id.client, id.clock, length);
    for (const [client, ranges] of ds.clients) {
      for (const { clock, len } of ranges) note(doc, difference, client, clock, len);
    }
  }
  return { edits: waiting.length, at: waiting.at(-1)?.at ?? 0, difference };
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

/** What has to change so that `before` becomes `after`. */
export function differenceOf(before: Y.Doc, after: Y.Doc): Difference {
  const [old, now] = [mapsOf(before), mapsOf(after)];
  const difference = mutable();
  for (const root of ROOTS) {
    for (const [key, value] of now[root]) {
      if (!same(value, old[root].get(key))) difference[root].set(key, value);
    }
    for (const key of old[root].keys()) {
      if (!now[root].has(key)) difference[root].set(key, undefined);
    }
  }
  return difference;
}

/**
 * Makes the same changes here as one fresh edit. Fields of actions that are not there are left out,
 * since nobody would see them. Answers how many keys changed.
 */
export function applyDifference(doc: Y.Doc, difference: Difference): number {
  const actions = rootOf(doc, "actions");
  const lives = (head: string) => actions.has(head) || difference.actions.get(head) !== undefined;
  let changed = 0;
  together(doc, () => {
    for (const root of ROOTS) {
      const map = rootOf(doc, root);
      for (const [key, value] of difference[root]) {
        const { head, rest } = splitKey(key);
        if (root === "actions" && rest !== "" && !lives(head)) continue;
        if (value === undefined ? !map.has(key) : same(map.get(key), value)) continue;
        if (value === undefined) map.delete(key);
        else map.set(key, value);
        changed += 1;
      }
    }
  });
  return changed;
}

function mutable(): { readonly [R in Root]: Map<string, unknown> } {
  return mapsFrom({}) as { readonly [R in Root]: Map<string, unknown> };
}
