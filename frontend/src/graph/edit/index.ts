/**
 * Every edit of a graph, as functions over the Yjs document.
 *
 * Each is one transaction of the person's own (see `OWN_EDITS`), so one update for the others and one
 * step of undo; `asOneEdit` joins several. An edit of something that a colleague has deleted
 * meanwhile does nothing and says so by its answer: null or false. What was imported and did not fit
 * (`x/<field>`) gives way to the first edit of its field.
 */

import type * as Y from "yjs";
import { newAid, noteKey, rootOf } from "../document-keys";
import type { Direction, JsonText, Key, Position } from "../model";
import { asPosition } from "../values";
import { rename } from "./actions";
import { asOneEdit, eraseKeys, hasEnd, writeKey } from "./document-writes";
import { moveWaypoints } from "./waypoints";

export * from "./actions";
export { asOneEdit, undoOf } from "./document-writes";
export * from "./parameters";
export * from "./relations";

/** Renames the graph. Returns true, as edits do whose thing still exists: a graph is never gone for its own page. */
export function setGraphName(doc: Y.Doc, name: string): true {
  asOneEdit(doc, () => {
    writeKey(doc, "meta", "name", name);
    eraseKeys(doc, "meta", "x/graph_name");
  });
  return true;
}

/** Renames the action of a document of the library, and the document with it. False when it is gone. */
export function renameDocument(doc: Y.Doc, key: Key, name: string): boolean {
  return asOneEdit(doc, () => rename(doc, key, name) && setGraphName(doc, name));
}

export function setGraphDescription(doc: Y.Doc, description: string): true {
  asOneEdit(doc, () => {
    writeKey(doc, "meta", "description", description);
    eraseKeys(doc, "meta", "x/graph_description");
  });
  return true;
}

/** Sets whether the graph is drawn downwards or to the right; a document that says nothing means down. */
export function setDirection(doc: Y.Doc, direction: Direction): void {
  asOneEdit(doc, () => {
    const now = rootOf(doc, "meta").get("direction") === "right" ? "right" : "down";
    if (now === direction) return;
    if (direction === "down") eraseKeys(doc, "meta", "direction");
    else writeKey(doc, "meta", "direction", direction);
  });
}

/**
 * Writes the places (px) of actions, `ENTRY` and `EXIT`, once, when they are dropped. Bends of lines
 * whose two ends move by the same way move along.
 */
export function moveActions(doc: Y.Doc, positions: Iterable<readonly [Key, Position]>): void {
  asOneEdit(doc, () => {
    const moved = new Map<Key, Position>();
    for (const [key, [x, y]] of positions) {
      if (!hasEnd(doc, key)) continue;
      const old = asPosition(rootOf(doc, "positions").get(key));
      if (old?.[0] === x && old[1] === y) continue;
      rootOf(doc, "positions").set(key, [x, y]);
      if (old) moved.set(key, [x - old[0], y - old[1]]);
    }
    if (moved.size > 0) moveWaypoints(doc, moved);
  });
}

/**
 * Writes where elements without a place are drawn, with the direction in which they are drawn: before somebody
 * moves one of them, so that the others stay.
 */
export function moveLoose(
  doc: Y.Doc,
  direction: Direction,
  positions: readonly (readonly [Key, Position])[],
): void {
  if (positions.length === 0) return;
  asOneEdit(doc, () => {
    setDirection(doc, direction);
    moveActions(doc, positions);
  });
}

/** The origin of places that the page sets by itself: they are no step of undo. */
const FIRST_LAYOUT: unique symbol = Symbol("places that nobody has asked for");

/** Places actions like `moveActions`, in a graph that nobody has placed yet: undo does not take it back. */
export function placeFirst(doc: Y.Doc, positions: Iterable<readonly [Key, Position]>): void {
  doc.transact(() => moveActions(doc, positions), FIRST_LAYOUT);
}

/** Returns true if the graph has nothing that runs: no action, and no arrow from the entry. */
export function isUndrawn(doc: Y.Doc): boolean {
  return rootOf(doc, "actions").size === 0 && rootOf(doc, "relations").size === 0;
}

/** Adds a note or frame; `text` is its JSON. Returns its id. */
export function addNote(doc: Y.Doc, text: JsonText): string {
  const id = newAid();
  asOneEdit(doc, () => writeKey(doc, "positions", noteKey(id), text));
  return id;
}

/** Writes the JSON of a note or frame. False when it is gone. */
export function setNote(doc: Y.Doc, id: string, text: JsonText): boolean {
  if (!rootOf(doc, "positions").has(noteKey(id))) return false;
  asOneEdit(doc, () => writeKey(doc, "positions", noteKey(id), text));
  return true;
}

export function removeNotes(doc: Y.Doc, ids: Iterable<string>): void {
  asOneEdit(doc, () => {
    for (const id of ids) eraseKeys(doc, "positions", noteKey(id));
  });
}
