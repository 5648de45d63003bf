/**
 * Actions and notes that were deleted while this page is open: what they were, so that they can be
 * restored, and what a deletion has left over.
 *
 * A name is the key by which an action exists. When somebody renames an action while somebody else
 * deletes it, the name is written anew and everything else is gone: an action without parameters and
 * arrows, which nobody wanted. Here the deletion wins as a whole, and the person is told, with a way to
 * restore all of it under its new name.
 */

import type * as Y from "yjs";
import {
  actionKey,
  bundleOfKey,
  endsOf,
  extraKey,
  isAid,
  type Root,
  rootOf,
  splitKey,
} from "../document-keys";
import type { Key } from "../model";
import { asInstanceId, asText } from "../values";
import { asOneEdit, eraseKeys, hasAction, hasEnd, hasRelation, writeKey } from "./document-writes";
import { readNote } from "./notes";

interface Entry {
  readonly root: Root;
  readonly key: string;
  readonly value: unknown;
}

export interface Deleted {
  /** The key of the action or note. */
  readonly key: Key;
  /** The name that people see. */
  readonly name: string;
}

/** At most this many deletions are remembered; the oldest go first. */
const MOST = 500;
/** The page that renamed an action has this time to remove what a deletion left over, ms. */
const TURN_MS = 2_000;
/** Not among `OWN_EDITS`: it is no step of anybody's undo. */
const CLEARING: unique symbol = Symbol("what a deletion has left over");

export class Deletions {
  private readonly doc: Y.Doc;
  private readonly mayEdit: () => boolean;
  private readonly known = new Map<Key, readonly Entry[]>();
  private readonly listeners = new Set<(deleted: Deleted) => void>();
  private readonly halfListeners = new Set<(deleted: Deleted) => void>();
  private readonly timers = new Map<Key, ReturnType<typeof setTimeout>>();
  private removed: Entry[] = [];
  private named = new Set<Key>();
  private ordered = new Set<Key>();
  private readonly stops: (() => void)[] = [];

  constructor(doc: Y.Doc, mayEdit: () => boolean) {
    this.doc = doc;
    this.mayEdit = mayEdit;
  }

  open(): void {
    for (const root of ["actions", "relations", "positions"] as const) {
      const map = rootOf(this.doc, root);
      const onChange = (event: Y.YMapEvent<unknown>) => this.hear(root, event);
      map.observe(onChange);
      this.stops.push(() => map.unobserve(onChange));
    }
    this.doc.on("afterTransaction", this.onEnd);
    this.stops.push(() => this.doc.off("afterTransaction", this.onEnd));
  }

  close(): void {
    for (const stop of this.stops.splice(0)) stop();
    for (const timer of this.timers.values()) clearTimeout(timer);
  }

  /** Tells of what others delete. */
  onDeleted(listener: (deleted: Deleted) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Tells of actions that were deleted while somebody renamed them. */
  onRenamedMeanwhile(listener: (deleted: Deleted) => void): () => void {
    this.halfListeners.add(listener);
    return () => this.halfListeners.delete(listener);
  }

  /** Returns what is known about a deleted action or note; null when it exists, or is unknown. */
  of(key: Key): Deleted | null {
    const entries = this.known.get(key);
    return entries === undefined || this.isThere(key) ? null : { key, name: nameIn(key, entries) };
  }

  /**
   * Puts it back with its parameters, arrows and place, as an edit of the person's own. What somebody
   * wrote there since stays, and arrows whose other end is gone stay away. False when it is there.
   */
  restore(key: Key): boolean {
    const entries = this.known.get(key);
    if (entries === undefined || this.isThere(key)) return false;
    asOneEdit(this.doc, () => {
      for (const entry of byRoot(entries)) {
        if (!this.fits(entry) || rootOf(this.doc, entry.root).has(entry.key)) continue;
        writeKey(this.doc, entry.root, entry.key, entry.value);
      }
    });
    return true;
  }

  private isThere(key: Key): boolean {
    return isAid(key) ? hasAction(this.doc, key) : rootOf(this.doc, "positions").has(key);
  }

  private fits({ root, key }: Entry): boolean {
    const { head } = splitKey(bundleOfKey(key) ?? key);
    if (root === "positions") return bundleOfKey(key) === null || hasRelation(this.doc, head);
    const ends = root === "relations" ? endsOf(head) : null;
    return ends === null || (hasEnd(this.doc, ends.parent) && hasEnd(this.doc, ends.child));
  }

  private hear(root: Root, event: Y.YMapEvent<unknown>): void {
    for (const [key, { action, oldValue }] of event.changes.keys) {
      if (action === "delete") this.removed.push({ root, key, value: oldValue });
      else if (root === "actions") {
        const { head, rest } = splitKey(key);
        if (isAid(key)) this.named.add(key);
        else if (rest === "order" && action === "add") this.ordered.add(head);
      }
    }
  }

  private readonly onEnd = ({ local, origin }: Y.Transaction): void => {
    const { removed, named, ordered } = this;
    if (removed.length + named.size + ordered.size === 0) return;
    this.removed = [];
    this.named = new Set();
    this.ordered = new Set();
    if (origin === CLEARING) return;
    if (local) for (const key of ordered) this.nameAgain(key);
    const owners = ownersOf(removed);
    for (const [key, entries] of owners) {
      if (!this.isThere(key) && entries.some((entry) => isExistence(entry, key))) {
        this.remember(key, entries);
        const deleted = this.of(key);
        if (!local && deleted !== null) tell(this.listeners, deleted);
      } else if (entries.some((entry) => entry.key === actionKey(key, "order"))) {
        if (this.isHalf(key)) this.remember(key, entries);
        named.add(key);
      }
    }
    for (const key of named) if (this.known.has(key) && this.isHalf(key)) this.clearSoon(key);
  };

  /** Every action is made with an order, which no renaming writes. */
  private isHalf(key: Key): boolean {
    if (!hasAction(this.doc, key)) return false;
    const actions = rootOf(this.doc, "actions");
    return !actions.has(actionKey(key, "order")) && actions.get(actionKey(key, "missing")) !== true;
  }

  private remember(key: Key, entries: readonly Entry[]): void {
    const old = this.known.get(key) ?? [];
    const fresh = new Set(entries.map(({ root, key }) => `${root} ${key}`));
    this.known.delete(key);
    this.known.set(key, [
      ...old.filter(({ root, key }) => !fresh.has(`${root} ${key}`)),
      ...entries,
    ]);
    for (const oldest of this.known.keys()) {
      if (this.known.size <= MOST) break;
      this.known.delete(oldest);
    }
  }

  /**
   * Handles an undo of a deletion that left out the name, since others wrote or cleared it: restores all of the
   * action.
   */
  private nameAgain(key: Key): void {
    const entry = this.known.get(key)?.find((each) => isExistence(each, key));
    if (entry === undefined || this.isThere(key)) return;
    this.doc.transact(() => writeKey(this.doc, "actions", key, entry.value), CLEARING);
  }

  /** The page that wrote the name does it at once; the others only where it does not. */
  private clearSoon(key: Key): void {
    clearTimeout(this.timers.get(key));
    const item = rootOf(this.doc, "actions")._map.get(key);
    const isOwn = item?.id.client === this.doc.clientID;
    this.timers.set(
      key,
      setTimeout(() => this.clear(key), isOwn ? 0 : TURN_MS),
    );
  }

  private clear(key: Key): void {
    this.timers.delete(key);
    if (!this.isHalf(key) || !this.mayEdit()) return;
    const left = this.leftOf(key);
    this.remember(key, left);
    this.doc.transact(() => {
      for (const { root, key } of left) eraseKeys(this.doc, root, key);
    }, CLEARING);
    const deleted = this.of(key);
    if (deleted !== null) tell(this.halfListeners, deleted);
  }

  /** Returns the entries that the document still has of an action: its fields, arrows and place. */
  private leftOf(key: Key): Entry[] {
    const of = (root: Root, fits: (head: string) => boolean): Entry[] =>
      [...rootOf(this.doc, root).entries()]
        .filter(([each]) => fits(splitKey(bundleOfKey(each) ?? each).head))
        .map(([each, value]) => ({ root, key: each, value }));
    const isArrow = (head: string) => {
      const ends = endsOf(head);
      return ends !== null && (ends.parent === key || ends.child === key);
    };
    return [
      ...of("actions", (head) => head === key),
      ...of("relations", isArrow),
      ...of("positions", (head) => head === key || isArrow(head)),
    ];
  }
}

function tell(listeners: ReadonlySet<(deleted: Deleted) => void>, deleted: Deleted): void {
  for (const listener of [...listeners]) listener(deleted);
}

/** Entries by what they belong to: an action with its arrows and places, or a note. */
function ownersOf(entries: readonly Entry[]): Map<Key, Entry[]> {
  const owners = new Map<Key, Entry[]>();
  const add = (key: Key, entry: Entry) => {
    const known = owners.get(key);
    if (known) known.push(entry);
    else owners.set(key, [entry]);
  };
  for (const entry of entries) {
    const { head } = splitKey(bundleOfKey(entry.key) ?? entry.key);
    const ends = endsOf(head);
    if (ends === null) add(head, entry);
    else for (const end of new Set([ends.parent, ends.child])) if (isAid(end)) add(end, entry);
  }
  return owners;
}

/** Returns true if this entry is the one by which an action or a note exists; an action's place has the same key. */
const isExistence = ({ root, key }: Entry, of: Key): boolean =>
  key === of && root === (isAid(of) ? "actions" : "positions");

/** Actions before their arrows, and these before their bends. */
const byRoot = (entries: readonly Entry[]): Entry[] =>
  (["actions", "relations", "positions"] as const).flatMap((root) =>
    entries.filter((entry) => entry.root === root),
  );

function nameIn(key: Key, entries: readonly Entry[]): string {
  const value = (wanted: string) =>
    entries.find((entry) => entry.root === "actions" && entry.key === wanted)?.value;
  const text = asText(entries.find((entry) => isExistence(entry, key))?.value) ?? "";
  if (!isAid(key)) return readNote(key, text)?.kind === "frame" ? "The frame" : "The note";
  const number = asInstanceId(value(actionKey(key, "instance_id"))) ?? 0;
  return `${text || asText(value(extraKey(key, "name"))) || "An action"} ${number}`;
}
