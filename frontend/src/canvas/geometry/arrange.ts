/**
 * Sizes and places of everything on the canvas. Elements without a place of their own get a simple
 * one at once; `layout.ts` lays graphs out properly.
 */
import {
  type Action,
  type Direction,
  ENTRY,
  EXIT,
  type Graph,
  type Key,
  type Position,
} from "../../graph/model";
import { cardRows } from "../../graph/parameters/card-rows";
import {
  arrangedByRank,
  CARD,
  GAP,
  type Positions,
  pillSize,
  SHORT_PILL,
  type Size,
  type Sizes,
  sizeOf,
} from "./ranks";

/** The number of parameters that a card shows; in a run, its state replaces the last one. */
export const CARD_LINES = 3;

/** Measures of `action-card.module.css`, px: heights without parameters, and what parameters add. */
const HEIGHT = { plain: 68, low: 58, least: 88, lines: 4, line: 18 } as const;

/** Cached numbers of rows; in a large graph few actions change at once. */
const rowCounts = new WeakMap<Action["inputs"], number>();

function rowCount(inputs: Action["inputs"]): number {
  const known = rowCounts.get(inputs) ?? cardRows(inputs).length;
  rowCounts.set(inputs, known);
  return known;
}

/** Return the size of an action's card; it is the same at rest, in a run, and while it is selected. */
export function cardSize({ inputs }: Pick<Action, "inputs">, direction: Direction): Size {
  const lines = Math.min(CARD_LINES - 1, rowCount(inputs));
  const text = lines === 0 ? 0 : HEIGHT.lines + lines * HEIGHT.line;
  const height =
    direction === "right" ? Math.max(HEIGHT.least, HEIGHT.low + text) : HEIGHT.plain + text;
  return { width: CARD.width, height };
}

/** Return the sizes of all cards and of entry and exit before they are rendered. */
export function estimatedSizes({ actions, direction }: Graph): Map<Key, Size> {
  return new Map<Key, Size>([
    [ENTRY, pillSize(direction)],
    [EXIT, pillSize(direction)],
    ...actions.map((action) => [action.key, cardSize(action, direction)] as const),
  ]);
}

/** Return the simple places of a graph, which serve until its layout is ready. */
export function arrange(graph: Graph, sizes: Sizes = estimatedSizes(graph)): Positions {
  return arrangedByRank(graph, sizes, graph.direction);
}

function knownPlaces(graph: Graph): Positions {
  const known: Positions = new Map();
  for (const { key, position } of graph.actions) if (position) known.set(key, position);
  if (graph.entryPosition) known.set(ENTRY, graph.entryPosition);
  if (graph.exitPosition) known.set(EXIT, graph.exitPosition);
  return known;
}

/** Return whether no action has a place, so that the graph should be laid out. */
export function isUnplaced(graph: Graph): boolean {
  return graph.actions.length > 0 && graph.actions.every(({ position }) => position === null);
}

/**
 * Return the drawn places of elements that have none in the document; empty if every action has
 * one. They are written before somebody moves one element, so that the others stay where they are.
 */
export function unplaced(graph: Graph, places: ReadonlyMap<Key, Position>): [Key, Position][] {
  const loose = graph.actions.filter((action) => action.position === null);
  if (loose.length === 0) return [];
  const keys = loose.map((action) => action.key);
  if (!graph.entryPosition) keys.push(ENTRY);
  if (!graph.exitPosition) keys.push(EXIT);
  return keys.flatMap((key): [Key, Position][] => {
    const at = places.get(key);
    return at ? [[key, at]] : [];
  });
}

export interface Box extends Size {
  readonly x: number;
  readonly y: number;
}

const AIR = 32; // px, the least distance between cards

/** Return the nearest free place from `start`, searching across the direction of the graph. */
export function freeSpot(
  start: Position,
  size: Size,
  taken: readonly Box[],
  direction: Direction,
): Position {
  let [x, y] = start;
  const hit = () =>
    taken.find(
      (box) =>
        x < box.x + box.width + AIR &&
        x + size.width + AIR > box.x &&
        y < box.y + box.height + AIR &&
        y + size.height + AIR > box.y,
    );
  for (let box = hit(); box !== undefined; box = hit()) {
    if (direction === "right") y = box.y + box.height + AIR;
    else x = box.x + box.width + AIR;
  }
  return [Math.round(x), Math.round(y)];
}

/** Return the place after a box in the direction of the graph. */
export function placeAfter({ x, y, width, height }: Box, direction: Direction): Position {
  return direction === "right" ? [x + width + GAP.along, y] : [x, y + height + GAP.along];
}

/** Add places for actions without one: behind the action that leads to them, where there is room. */
function placeLoose(graph: Graph, places: Positions, sizes: Sizes): void {
  const { direction } = graph;
  const boxOf = (key: Key): Box | null => {
    const at = places.get(key);
    return at ? { x: at[0], y: at[1], ...sizeOf(key, sizes, direction) } : null;
  };
  const loose = graph.actions.filter(({ key }) => !places.has(key));
  if (loose.length === 0) return;
  const before = new Map<Key, Key[]>();
  for (const { parent, child } of graph.relations) {
    before.set(child, [...(before.get(child) ?? []), parent]);
  }
  const taken = [...places.keys()].flatMap((key) => boxOf(key) ?? []);
  const left = Math.min(...taken.map(({ x }) => x));
  const low = Math.max(...taken.map(({ y, height }) => y + height));
  for (const { key } of loose) {
    const [parent] = (before.get(key) ?? []).flatMap((other) => boxOf(other) ?? []);
    const start: Position = parent ? placeAfter(parent, direction) : [left, low + GAP.across];
    const at = freeSpot(start, sizeOf(key, sizes, direction), taken, direction);
    places.set(key, at);
    taken.push({ x: at[0], y: at[1], ...sizeOf(key, sizes, direction) });
  }
}

/**
 * Return the place, across the direction, at which an end is centred on the actions tied to it;
 * without any, on the first action.
 */
function middle(graph: Graph, end: Key, places: Positions, sizes: Sizes): number {
  const { direction } = graph;
  const tied = graph.relations.flatMap((r) =>
    end === ENTRY && r.parent === ENTRY
      ? [r.child]
      : end === EXIT && r.child === EXIT
        ? [r.parent]
        : [],
  );
  const keys = tied.length > 0 ? tied : graph.actions.slice(0, 1).map((action) => action.key);
  const middles = keys.flatMap((key) => {
    const at = places.get(key);
    const size = sizeOf(key, sizes, direction);
    if (!at) return [];
    return [direction === "right" ? at[1] + size.height / 2 : at[0] + CARD.width / 2];
  });
  const mean = middles.reduce((sum, each) => sum + each, 0) / Math.max(1, middles.length);
  const pill = pillSize(direction);
  return Math.round(mean - (direction === "right" ? pill.height : pill.width) / 2);
}

/** Return the places of all elements; those with a place of their own keep it. */
export function positionsOf(graph: Graph, sizes: Sizes = estimatedSizes(graph)): Positions {
  const places = knownPlaces(graph);
  if (places.size === 0) return arrange(graph, sizes);
  placeLoose(graph, places, sizes);
  const { direction } = graph;
  const right = direction === "right";
  const cards = graph.actions.flatMap(({ key }) => {
    const at = places.get(key);
    return at ? [[at, sizeOf(key, sizes, direction)] as const] : [];
  });
  const first = Math.min(...cards.map(([[x, y]]) => (right ? x : y)), Number.POSITIVE_INFINITY);
  const last = Math.max(
    ...cards.map(([[x, y], { width, height }]) => (right ? x + width : y + height)),
    Number.NEGATIVE_INFINITY,
  );
  const put = (end: Key, along: number) => {
    if (places.has(end)) return;
    const across = middle(graph, end, places, sizes);
    places.set(end, right ? [along, across] : [across, along]);
  };
  const empty = cards.length === 0;
  put(ENTRY, empty ? 0 : right ? first - SHORT_PILL.width - 64 : first - 92);
  put(EXIT, empty ? 220 : last + 64);
  return places;
}
