/** Writes edits: one transaction each, only what differs, under one origin that undo knows. */

import * as Y from "yjs";
import {
  endsOf,
  isAid,
  mapsFrom,
  mapsOf,
  type Root,
  rootOf,
  splitKey,
  waypointsKey,
} from "../document-keys";
import {
  ENTRY,
  EXIT,
  type Graph,
  type Key,
  PRECONDITIONS,
  RESPONSES,
  type Relation,
  type Response,
} from "../model";
import { readGraph, readTakenUp } from "../read";
import { asNumber, asResponse } from "../values";
import { refuseTooLarge } from "./edit-size";
import { UndoHistory } from "./undo-history";

/** The origin of everything that the person at this page does. */
const OWN_EDITS: unique symbol = Symbol("the person at this page");

/**
 * Runs several edits as one: one transaction, one update for the others, one step of undo. An edit with a value
 * that no message could hold changes nothing, see `onTooLarge`.
 */
export function asOneEdit<T>(doc: Y.Doc, work: () => T): T {
  if (doc._transaction !== null) return work(); // a part of the edit around it
  return doc.transact((transaction) => {
    const result = work();
    refuseTooLarge(doc, transaction);
    return result;
  }, OWN_EDITS);
}

/** Returns the undo and redo of the person's own edits; one edit (or one `asOneEdit`) is one step. */
export function undoOf(doc: Y.Doc): UndoHistory {
  return new UndoHistory(doc, OWN_EDITS);
}

export function writeKey(doc: Y.Doc, root: Root, key: string, value: unknown): void {
  const map = rootOf(doc, root);
  if (!map.has(key) || map.get(key) !== value) map.set(key, value);
}

/** Erases keys. A shared type, which no page of ours writes, stays: undo could not bring it back. */
export function eraseKeys(doc: Y.Doc, root: Root, ...keys: readonly string[]): void {
  const map = rootOf(doc, root);
  for (const key of keys) {
    if (map.has(key) && !(map.get(key) instanceof Y.AbstractType)) map.delete(key);
  }
}

/** Returns the keys of an owner, with `<head>` itself. */
function keysOfOwner(doc: Y.Doc, root: Root, head: string): string[] {
  const prefix = `${head}|`;
  return [...rootOf(doc, root).keys()].filter((key) => key === head || key.startsWith(prefix));
}

export function hasAction(doc: Y.Doc, key: Key): boolean {
  return isAid(key) && typeof rootOf(doc, "actions").get(key) === "string";
}

export function hasRelation(doc: Y.Doc, id: string): boolean {
  const ends = endsOf(id);
  if (ends === null) return false;
  const map = rootOf(doc, "relations");
  if (ends.parent === ENTRY) return map.get(`${id}|on_true`) === "run";
  return PRECONDITIONS.some((outcome) => asResponse(map.get(`${id}|${outcome}`)) !== undefined);
}

export const hasEnd = (doc: Y.Doc, key: Key): boolean =>
  key === ENTRY || key === EXIT || hasAction(doc, key);

export const graphNow = (doc: Y.Doc): Graph => readGraph(mapsOf(doc));

const NUMBERING = new Set(["", "instance_id", "missing", "twin"]);

/** The actions with their names and numbers only, which is much less to read. */
export function numbersOf(doc: Y.Doc): Graph["actions"] {
  const actions = new Map<string, unknown>();
  for (const [key, value] of rootOf(doc, "actions").entries()) {
    if (NUMBERING.has(splitKey(key).rest)) actions.set(key, value);
  }
  return readGraph({ ...mapsFrom({}), actions }).actions;
}

/** The number after the greatest one under the keys that fit. */
export function nextNumber(doc: Y.Doc, root: Root, field: string, fits: (head: string) => boolean) {
  let next = 0;
  for (const [key, value] of rootOf(doc, root).entries()) {
    const { head, rest } = splitKey(key);
    const number = rest === field && fits(head) ? asNumber(value) : undefined;
    if (number !== undefined) next = Math.max(next, Math.floor(number) + 1);
  }
  return next;
}

/** Moves a relation with everything it says, and with the bends of its lines, under another id. */
export function moveKeys(doc: Y.Doc, from: string, to: string): void {
  const map = rootOf(doc, "relations");
  for (const key of keysOfOwner(doc, "relations", from)) {
    map.set(to + key.slice(from.length), map.get(key));
    map.delete(key);
  }
  for (const response of RESPONSES) moveWaypointsKey(doc, [from, response], [to, response]);
}

/** Gives the waypoints of one line to another, which keeps its own if it has some. */
function moveWaypointsKey(
  doc: Y.Doc,
  from: readonly [relation: string, Response],
  to: readonly [relation: string, Response],
): void {
  const [old, next] = [waypointsKey(from.join("|")), waypointsKey(to.join("|"))];
  const text = rootOf(doc, "positions").get(old);
  if (text === undefined) return;
  if (!rootOf(doc, "positions").has(next)) writeKey(doc, "positions", next, text);
  eraseKeys(doc, "positions", old);
}

/** The bends of all lines of a relation. */
export function eraseWaypoints(doc: Y.Doc, id: string): void {
  const keys = RESPONSES.map((response) => waypointsKey(`${id}|${response}`));
  eraseKeys(doc, "positions", ...keys);
}

/** Erases a relation: its fields, and the bends of its lines. */
export function eraseRelation(doc: Y.Doc, id: string): void {
  eraseKeys(doc, "relations", ...keysOfOwner(doc, "relations", id));
  eraseWaypoints(doc, id);
}

/** The responses that have a line of their own. */
function responsesNow(doc: Y.Doc, id: string): ReadonlySet<Response> {
  const map = rootOf(doc, "relations");
  const said = PRECONDITIONS.flatMap((outcome) => asResponse(map.get(`${id}|${outcome}`)) ?? []);
  const spoken = new Set(said.filter((response) => response !== "ignore"));
  return spoken.size > 0 ? spoken : new Set(["ignore"]);
}

/** Changes what a relation says; a line that says something else now keeps its bends. */
export function keepingWaypoints(doc: Y.Doc, id: string, write: () => void): void {
  const before = responsesNow(doc, id);
  write();
  const after = responsesNow(doc, id);
  const [fresh, ...others] = [...after].filter((response) => !before.has(response));
  for (const gone of before) {
    if (after.has(gone)) continue;
    if (fresh && others.length === 0) moveWaypointsKey(doc, [id, gone], [id, fresh]);
    else eraseKeys(doc, "positions", waypointsKey(`${id}|${gone}`));
  }
}

/**
 * Stores what the reader shows already: arrows of ghosts whose name a real action has become that action's own, so
 * that renaming it later does not leave them behind.
 */
export function numberGhosts(doc: Y.Doc): void {
  const actions = rootOf(doc, "actions");
  if (![...actions.keys()].some((key) => key.endsWith("|missing"))) return;
  const { ghosts, arrows } = readTakenUp(mapsOf(doc));
  for (const [from, to] of arrows) moveKeys(doc, from, to);
  for (const ghost of ghosts) {
    eraseKeys(doc, "actions", ...keysOfOwner(doc, "actions", ghost));
    eraseKeys(doc, "positions", ghost);
  }
}

/** Returns the present relation of the document; undefined when it is missing. */
export function relationNow(doc: Y.Doc, id: string): Relation | undefined {
  const ends = endsOf(id);
  if (ends === null) return undefined;
  return graphNow(doc).relations.find(
    (relation) =>
      relation.parent === ends.parent &&
      relation.child === ends.child &&
      relation.listing === ends.listing,
  );
}
