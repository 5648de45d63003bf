/** Waypoints: the places through which people lead the line of an arrow, as JSON text. Pure. */
import type { JsonText, Key, Position, Relation } from "./model";
import { asNumber } from "./values";

/** The most bends of a line: more are not needed, and each is one more line to route. */
export const MOST_WAYPOINTS = 8;
const FARTHEST = 1e7; // px, as of cards

/** Reads bends from a text, on whole pixels; empty when the text is none of ours, which then stays as it is. */
export function readWaypoints(text: JsonText): readonly Position[] {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch {
    return [];
  }
  if (!Array.isArray(value) || value.length > MOST_WAYPOINTS) return [];
  const places = (value as unknown[]).flatMap((pair): Position[] => {
    const [x, y] = Array.isArray(pair) && pair.length === 2 ? pair.map(asNumber) : [];
    if (x === undefined || y === undefined) return [];
    return Math.max(Math.abs(x), Math.abs(y)) < FARTHEST ? [[Math.round(x), Math.round(y)]] : [];
  });
  return places.length === value.length ? places : [];
}

/** Returns true if somebody has bent a line of the relation. */
export const isBent = ({ waypoints }: Relation): boolean =>
  waypoints.some(([, text]) => readWaypoints(text).length > 0);

/** Returns by how much both ends of a relation have moved together, px; null if they have not. */
export function movedTogether(
  { parent, child }: Pick<Relation, "parent" | "child">,
  moved: ReadonlyMap<Key, Position>,
): Position | null {
  const [by, other] = [moved.get(parent), moved.get(child)];
  if (!by || by[0] !== other?.[0] || by[1] !== other[1]) return null;
  return by[0] === 0 && by[1] === 0 ? null : by;
}

export const shifted = (places: readonly Position[], [dx, dy]: Position): Position[] =>
  places.map(([x, y]) => [x + dx, y + dy]);

/** Returns the distance that each thing has moved between two sets of places. */
export function movesBetween(
  before: ReadonlyMap<Key, Position>,
  after: ReadonlyMap<Key, Position>,
): Map<Key, Position> {
  const moved = new Map<Key, Position>();
  for (const [key, [x, y]] of after) {
    const old = before.get(key);
    if (old && (old[0] !== x || old[1] !== y)) moved.set(key, [x - old[0], y - old[1]]);
  }
  return moved;
}
