/** Edits of relations: connect, responses, order of waiting, remaps, the graph's two ends. */

import type * as Y from "yjs";
import { endsOf, relationId, rootOf } from "../document-keys";
import { ENTRY, EXIT, type Key, type Precondition, type Response, spokenOutcomes } from "../model";
import {
  asOneEdit,
  eraseKeys,
  eraseRelation,
  eraseWaypoints,
  hasEnd,
  hasRelation,
  keepingWaypoints,
  moveKeys,
  nextNumber,
  numberGhosts,
  relationNow,
  writeKey,
} from "./document-writes";
import { keepingWaits } from "./waits";

/**
 * Draws an arrow that says what was drawn: after `outcome` the child runs. Between two that are
 * connected already it adds that response. What the end of the graph waits for follows (`waits.ts`).
 * Returns the relation's id, or null when the ends do not fit: nothing leads into the entry or out
 * of the exit, nor from one to the other.
 */
export function connect(
  doc: Y.Doc,
  parent: Key,
  child: Key,
  outcome: Precondition = "on_true",
  response: Response = "run",
): string | null {
  return asOneEdit(doc, () => keepingWaits(doc, () => draw(doc, parent, child, outcome, response)));
}

/** Draws the arrow alone, as a part of an edit that keeps the ends itself. Returns as `connect` does. */
export function draw(
  doc: Y.Doc,
  parent: Key,
  child: Key,
  outcome: Precondition,
  response: Response,
): string | null {
  const drawn = relationId({ parent, child });
  if (endsOf(drawn) === null || !hasEnd(doc, parent) || !hasEnd(doc, child)) return null;
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    const known = pairOf(doc, parent, child);
    const id = known ?? drawn;
    if (known === null) {
      eraseRelation(doc, id);
      writeKey(doc, "relations", `${id}|po`, nextOf(doc, "po", "parent", parent));
      writeKey(doc, "relations", `${id}|co`, nextOf(doc, "co", "child", child));
    }
    if (parent === ENTRY) writeKey(doc, "relations", `${id}|on_true`, "run");
    else keepingWaypoints(doc, id, () => writeKey(doc, "relations", `${id}|${outcome}`, response));
    eraseKeys(doc, "relations", `${id}|only`);
    forget(doc, id, "conditions", "parents");
    forgetSide(doc, id);
    return id;
  });
}

/** The id of the first relation of a pair; null when there is none. */
function pairOf(doc: Y.Doc, parent: Key, child: Key): string | null {
  const head = relationId({ parent, child });
  if (hasRelation(doc, head)) return head;
  const listings = new Set<number>();
  for (const key of rootOf(doc, "relations").keys()) {
    if (!key.startsWith(`${head};`)) continue;
    const ends = endsOf(key.slice(0, key.indexOf("|")));
    if (ends && hasRelation(doc, relationId(ends))) listings.add(ends.listing);
  }
  if (listings.size === 0) return null;
  return relationId({ parent, child, listing: Math.min(...listings) });
}

function nextOf(doc: Y.Doc, field: "po" | "co", end: "parent" | "child", key: Key): number {
  return nextNumber(doc, "relations", field, (head) => endsOf(head)?.[end] === key);
}

/** An imported value of a field that did not fit gives way. */
function forget(doc: Y.Doc, id: string, field: string, side: "parents" | "children"): void {
  eraseKeys(doc, "relations", `${id}|x/${side}/${field}`);
}

/** An imported list that was none, on either side, gives way to a real relation. */
function forgetSide(doc: Y.Doc, id: string): void {
  const ends = endsOf(id);
  if (ends === null) return;
  if (ends.parent === ENTRY) eraseKeys(doc, "meta", "x/graph_entry");
  else eraseKeys(doc, "actions", `${ends.parent}|x/children`);
  if (ends.child === EXIT) eraseKeys(doc, "meta", "x/graph_exit");
  else eraseKeys(doc, "actions", `${ends.child}|x/parents`);
}

/** One edit of a relation that exists: false when it does not. */
function edit(doc: Y.Doc, id: string, write: () => void): boolean {
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    if (!hasRelation(doc, id)) return false;
    write();
    return true;
  });
}

/** A field that lives on one side of the file needs that side to be written. */
function needs(doc: Y.Doc, id: string, side: "parents" | "children"): void {
  const only = rootOf(doc, "relations").get(`${id}|only`);
  if (only !== undefined && only !== side) eraseKeys(doc, "relations", `${id}|only`);
}

/** Sets the response of the child to one outcome. An entry has `run` and no other response. */
export function setResponse(
  doc: Y.Doc,
  id: string,
  outcome: Precondition,
  response: Response,
): boolean {
  if (endsOf(id)?.parent === ENTRY) return false;
  return asOneEdit(doc, () => keepingWaits(doc, () => answer(doc, id, outcome, response)));
}

function answer(doc: Y.Doc, id: string, outcome: Precondition, response: Response): boolean {
  return edit(doc, id, () => {
    keepingWaypoints(doc, id, () => writeKey(doc, "relations", `${id}|${outcome}`, response));
    forget(doc, id, "conditions", "parents");
    needs(doc, id, "parents");
  });
}

/** Sets whether the child waits until this parent has reported. False when the relation is gone. */
export function setRequired(doc: Y.Doc, id: string, required: boolean): boolean {
  return edit(doc, id, () => {
    if (required) eraseKeys(doc, "relations", `${id}|required`);
    else writeKey(doc, "relations", `${id}|required`, false);
    forget(doc, id, "required", "parents");
    needs(doc, id, "parents");
  });
}

/**
 * Sets the name under which an output of the parent reaches the child (null: its own). False when the relation
 * is gone.
 */
export function setRemap(doc: Y.Doc, id: string, source: string, target: string | null): boolean {
  return edit(doc, id, () => {
    if (target === null) eraseKeys(doc, "relations", `${id}|remap/${source}`);
    else writeKey(doc, "relations", `${id}|remap/${source}`, target);
    forget(doc, id, "remap", "children");
    needs(doc, id, "children");
  });
}

/** Lists a relation on both sides that a file had on one only. False when it is gone. */
export function mirrorRelation(doc: Y.Doc, id: string): boolean {
  return edit(doc, id, () => eraseKeys(doc, "relations", `${id}|only`));
}

export function removeRelation(doc: Y.Doc, id: string): boolean {
  return edit(doc, id, () => eraseRelation(doc, id));
}

export function removeRelations(doc: Y.Doc, ids: Iterable<string>): void {
  asOneEdit(doc, () => {
    for (const id of ids) removeRelation(doc, id);
  });
}

/** Moves an end of an arrow, with all that it says. Null when that arrow exists already. */
export function moveRelation(
  doc: Y.Doc,
  id: string,
  ends: { readonly parent?: Key; readonly child?: Key },
): string | null {
  return asOneEdit(doc, () => keepingWaits(doc, () => move(doc, id, ends)));
}

function move(
  doc: Y.Doc,
  id: string,
  ends: { readonly parent?: Key; readonly child?: Key },
): string | null {
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    const old = endsOf(id);
    if (old === null || !hasRelation(doc, id)) return null;
    const parent = ends.parent ?? old.parent;
    const child = ends.child ?? old.child;
    const to = relationId({ parent, child });
    if (to === id) return id;
    if ((old.parent === ENTRY) !== (parent === ENTRY) || endsOf(to) === null) return null;
    if (!hasEnd(doc, parent) || !hasEnd(doc, child) || pairOf(doc, parent, child)) return null;
    eraseRelation(doc, to);
    if (parent !== old.parent)
      writeKey(doc, "relations", `${id}|po`, nextOf(doc, "po", "parent", parent));
    if (child !== old.child)
      writeKey(doc, "relations", `${id}|co`, nextOf(doc, "co", "child", child));
    moveKeys(doc, id, to);
    eraseKeys(doc, "relations", `${to}|only`);
    return to;
  });
}

/**
 * Leads one arrow, what the child does after one outcome, from or to somewhere else. What the same
 * relation says of other outcomes stays; when it says nothing else, `required` and remaps go along.
 */
export function retarget(
  doc: Y.Doc,
  id: string,
  outcome: Precondition,
  to: { readonly parent?: Key; readonly child?: Key; readonly outcome?: Precondition },
): string | null {
  return asOneEdit(doc, () => keepingWaits(doc, () => led(doc, id, outcome, to)));
}

function led(
  doc: Y.Doc,
  id: string,
  outcome: Precondition,
  to: { readonly parent?: Key; readonly child?: Key; readonly outcome?: Precondition },
): string | null {
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    const relation = relationNow(doc, id);
    if (relation === undefined) return null;
    const { conditions } = relation;
    const response = conditions[outcome];
    const parent = to.parent ?? relation.parent;
    const child = to.child ?? relation.child;
    const lands = parent === ENTRY ? "on_true" : (to.outcome ?? outcome);
    const same = parent === relation.parent && child === relation.child;
    if (same && lands === outcome) return id;
    const alone = spokenOutcomes(conditions).every((other) => other === outcome);
    const moved = alone && !same ? move(doc, id, { parent, child }) : null;
    if (moved !== null) {
      if (lands !== outcome) {
        answer(doc, moved, lands, response);
        answer(doc, moved, outcome, "ignore");
      }
      return moved;
    }
    const drawn = draw(doc, parent, child, lands, response);
    if (drawn === null) return null;
    if (alone && !same) removeRelation(doc, id);
    else answer(doc, id, outcome, "ignore");
    return drawn;
  });
}

/** Changes the places of two of a parent's relations, in the order in which their ends are started. */
export function swapOrder(doc: Y.Doc, ids: readonly string[], one: number, other: number): void {
  asOneEdit(doc, () => {
    numberGhosts(doc);
    const next = [...ids];
    [next[one], next[other]] = [ids[other] ?? "", ids[one] ?? ""];
    for (const [i, id] of next.entries()) {
      if (hasRelation(doc, id)) writeKey(doc, "relations", `${id}|po`, i);
    }
  });
}

/**
 * Puts an action into an arrow: it takes over what the arrow said, and its success leads on. False, without a
 * change, when the arrow is gone or ends at the action.
 */
export function insertInto(doc: Y.Doc, id: string, key: Key): boolean {
  return asOneEdit(doc, () => keepingWaits(doc, () => putBetween(doc, id, key)));
}

function putBetween(doc: Y.Doc, id: string, key: Key): boolean {
  const relation = relationNow(doc, id);
  if (relation === undefined || relation.parent === key || relation.child === key) return false;
  const onward = draw(doc, key, relation.child, "on_true", "run");
  if (onward === null) return false;
  writeKey(doc, "relations", `${onward}|co`, relation.childOrder);
  if (!relation.required) writeKey(doc, "relations", `${onward}|required`, false);
  const into = move(doc, id, { child: key });
  if (into === null) return removeRelation(doc, id);
  eraseWaypoints(doc, into); // they led past where the action stands now
  writeKey(doc, "relations", `${into}|po`, relation.parentOrder);
  eraseKeys(doc, "relations", `${into}|required`);
  return true;
}

/** Lets the graph start with this action. Returns the id of the arrow, null as `connect` does. */
export const setEntry = (doc: Y.Doc, key: Key): string | null => connect(doc, ENTRY, key);

export const unsetEntry = (doc: Y.Doc, key: Key): boolean => disconnect(doc, ENTRY, key);

/** Lets the graph end after this outcome of the action. Returns the id of the arrow, null as `connect` does. */
export const setExit = (doc: Y.Doc, key: Key, outcome: Precondition = "on_true"): string | null =>
  connect(doc, key, EXIT, outcome);

export const unsetExit = (doc: Y.Doc, key: Key): boolean => disconnect(doc, key, EXIT);

/** Removes every arrow from one action to another. False when there was none. */
export function disconnect(doc: Y.Doc, parent: Key, child: Key): boolean {
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    let removed = false;
    for (let id = pairOf(doc, parent, child); id; id = pairOf(doc, parent, child)) {
      eraseRelation(doc, id);
      removed = true;
    }
    return removed;
  });
}
