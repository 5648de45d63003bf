/** Edits of waypoints: lines that are bent, straightened, and moved along with their cards. */

import type * as Y from "yjs";
import { bundleOfKey, endsOf, relationId, rootOf, splitKey, waypointsKey } from "../document-keys";
import type { JsonText, Key, Position, Relation } from "../model";
import { MOST_WAYPOINTS, movedTogether, readWaypoints, shifted } from "../waypoints";
import { asOneEdit, eraseKeys, hasRelation, numberGhosts, writeKey } from "./document-writes";

/** Leads a line through these places; through none: it finds its own way. False when it is gone. */
export function setWaypoints(doc: Y.Doc, bundle: string, places: readonly Position[]): boolean {
  if (places.length > MOST_WAYPOINTS) return false;
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    if (!hasRelation(doc, splitKey(bundle).head)) return false;
    const key = waypointsKey(bundle);
    if (places.length === 0) eraseKeys(doc, "positions", key);
    else writeKey(doc, "positions", key, textOf(places));
    return true;
  });
}

const textOf = (places: readonly Position[]): JsonText =>
  JSON.stringify(places.map((place) => place.map(Math.round)));

/** Lets the lines of these relations find their own ways again. */
export function straighten(doc: Y.Doc, relations: Iterable<Relation>): void {
  asOneEdit(doc, () => {
    for (const relation of relations) {
      for (const [response, text] of relation.waypoints) {
        const key = waypointsKey(`${relationId(relation)}|${response}`);
        if (readWaypoints(text).length > 0) eraseKeys(doc, "positions", key);
      }
    }
  });
}

/** Lines whose two ends have moved by the same way keep their shape. */
export function moveWaypoints(doc: Y.Doc, moved: ReadonlyMap<Key, Position>): void {
  for (const [key, text] of [...rootOf(doc, "positions").entries()]) {
    const bundle = bundleOfKey(key);
    const ends = bundle === null ? null : endsOf(splitKey(bundle).head);
    const by = ends && movedTogether(ends, moved);
    const places = by && typeof text === "string" ? readWaypoints(text) : [];
    if (by && places.length > 0) writeKey(doc, "positions", key, textOf(shifted(places, by)));
  }
}
