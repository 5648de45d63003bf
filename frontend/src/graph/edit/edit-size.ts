/**
 * Limits the size of one value of an edit: an edit with a larger one is refused before it is sent, and none of it
 * is written.
 */

import type * as Y from "yjs";
import { ROOTS, type Root, rootOf } from "../document-keys";

/** Bytes of UTF-8. A message of a room has 1 MiB (rule R4 of docs/room-protocol.md), with the key and what leads to it. */
export const MOST_VALUE_BYTES = (1 << 20) - (1 << 13);

const utf8 = new TextEncoder();
const listeners = new WeakMap<Y.Doc, Set<(bytes: number) => void>>();

/** Calls back with the size of a value, in bytes, whenever an edit was refused for it. */
export function onTooLarge(doc: Y.Doc, listener: (bytes: number) => void): () => void {
  const all = listeners.get(doc) ?? new Set();
  listeners.set(doc, all.add(listener));
  return () => all.delete(listener);
}

/** Takes back all that this transaction has changed if one of its values is too large, and says so. */
export function refuseTooLarge(doc: Y.Doc, transaction: Y.Transaction): void {
  const changed = ROOTS.flatMap((root) =>
    [...(transaction.changed.get(rootOf(doc, root) as never) ?? [])].flatMap((key) =>
      key === null ? [] : [[root, key] as const],
    ),
  );
  const sizes = changed.map(([root, key]) => bytesOf(key) + bytesOf(rootOf(doc, root).get(key)));
  const largest = Math.max(0, ...sizes.filter((bytes) => bytes > MOST_VALUE_BYTES));
  if (largest === 0) return;
  for (const [root, key] of changed) restore(doc, transaction, root, key);
  for (const listener of listeners.get(doc) ?? []) listener(largest);
}

function bytesOf(value: unknown): number {
  if (typeof value !== "string" || value.length * 3 <= MOST_VALUE_BYTES) return 0;
  return utf8.encode(value).length;
}

function restore(doc: Y.Doc, transaction: Y.Transaction, root: Root, key: string): void {
  const map = rootOf(doc, root);
  const isNew = ({ client, clock }: Y.ID) => clock >= (transaction.beforeState.get(client) ?? 0);
  let item = map._map.get(key) ?? null;
  while (item !== null && isNew(item.id)) item = item.left;
  const old = item;
  const wasThere =
    old !== null &&
    (!old.deleted ||
      (transaction.deleteSet.clients.get(old.id.client) ?? []).some(
        ({ clock, len }) => clock <= old.id.clock && old.id.clock < clock + len,
      ));
  if (!wasThere) map.delete(key);
  else if (old.deleted) map.set(key, old.content.getContent().at(-1));
}
