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
  type Relation,
} from "../../graph/model";
import { cardRows } from "../../graph/parameters/card-rows";

export interface Size {
  readonly width: number;
  readonly height: number;
}
export type Sizes = ReadonlyMap<Key, Size>;
export type Positions = Map<Key, Position>;

export const CARD = { width: 208, height: 104 } as const;
/** Entry and exit of a graph that runs down: as wide as cards, so that equal x means equal middles. */
const PILL = { width: 208, height: 32 } as const;
/** Entry and exit of a graph that runs right. */
const SHORT_PILL = { width: 84, height: 32 } as const;
/** The number of parameters that a card shows; in a run, its state replaces the last one. */
export const CARD_LINES = 3;

/** Measures of `action-card.module.css`, px: heights without parameters, and what parameters add. */
const HEIGHT = { plain: 68, low: 58, least: 88, lines: 4, line: 18 } as const;
/** px kept free between cards that have not been laid out. */
const GAP = { along: 108, across: 56 } as const;

/** Return the size of the entry and exit of a graph. */
export const pillSize = (direction: Direction): Size => (direction === "right" ? SHORT_PILL : PILL);

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

function sizeOf(key: Key, sizes: Sizes, direction: Direction): Size {
  return sizes.get(key) ?? (key === ENTRY || key === EXIT ? pillSize(direction) : CARD);
}

/** The actions and arrows of a graph, as far as simple places depend on them. */
export interface Connected {
  readonly actions: readonly Pick<Action, "key">[];
  readonly relations: readonly Pick<Relation, "parent" | "child" | "parentOrder" | "listing">[];
}

/** Return the index of every element in the order of the file, from the entry to the exit. */
export function orderOf(graph: Connected): Map<Key, number> {
  return new Map([ENTRY, ...graph.actions.map(({ key }) => key), EXIT].map((key, i) => [key, i]));
}

/**
 * Return the relations in the order of the file, without those of an action to itself. It does not
 * depend on keys, which are random.
 */
export function relationsInOrder<G extends Connected>(
  graph: G,
  order = orderOf(graph),
): G["relations"][number][] {
  const at = (key: Key) => order.get(key) ?? 0;
  return graph.relations
    .filter(({ parent, child }) => parent !== child && order.has(parent) && order.has(child))
    .sort(
      (a, b) =>
        at(a.parent) - at(b.parent) ||
        a.parentOrder - b.parentOrder ||
        at(a.child) - at(b.child) ||
        a.listing - b.listing,
    );
}

/**
 * Return the successors of each element, without arrows that lead back (into an element on the
 * current path) and arrows to the exit.
 */
export function forward(graph: Connected): Map<Key, Key[]> {
  const all = new Map<Key, Key[]>([[ENTRY, []]]);
  for (const { key } of graph.actions) all.set(key, []);
  for (const { parent, child } of relationsInOrder(graph)) {
    if (child !== EXIT) all.get(parent)?.push(child);
  }
  const next = new Map<Key, Key[]>();
  const state = new Map<Key, "open" | "done">();
  for (const start of all.keys()) {
    const open: [Key, number][] = state.has(start) ? [] : [[start, 0]];
    while (open.length > 0) {
      const top = open[open.length - 1];
      if (top === undefined) break;
      const [key, i] = top;
      if (i === 0) {
        state.set(key, "open");
        next.set(key, []);
      }
      const child = all.get(key)?.[i];
      top[1] += 1;
      if (child === undefined) {
        state.set(key, "done");
        open.pop();
      } else if (state.get(child) !== "open") {
        next.get(key)?.push(child);
        if (!state.has(child)) open.push([child, 0]);
      }
    }
  }
  return next;
}

/** Return the rank of each element: greater than the ranks of all elements that lead to it. */
export function ranksOf(graph: Connected): Map<Key, number> {
  const next = forward(graph);
  const waiting = new Map<Key, number>([...next.keys()].map((key) => [key, 0]));
  for (const children of next.values()) {
    for (const child of children) waiting.set(child, (waiting.get(child) ?? 0) + 1);
  }
  const ranks = new Map<Key, number>([[ENTRY, 0]]);
  const ready = [...waiting].filter(([, n]) => n === 0).map(([key]) => key);
  for (const key of ready) {
    const rank = ranks.get(key) ?? 1;
    ranks.set(key, rank);
    for (const child of next.get(key) ?? []) {
      ranks.set(child, Math.max(ranks.get(child) ?? 1, rank + 1));
      const left = (waiting.get(child) ?? 0) - 1;
      waiting.set(child, left);
      if (left === 0) ready.push(child);
    }
  }
  ranks.set(EXIT, Math.max(...ranks.values()) + 1);
  return ranks;
}

/** Return the simple places of a graph, which serve until its layout is ready. */
export function arrange(graph: Graph, sizes: Sizes = estimatedSizes(graph)): Positions {
  return arrangedByRank(graph, sizes, graph.direction);
}

/** Return simple places: one row or column for each rank, centred. They serve for thumbnails, too. */
export function arrangedByRank(graph: Connected, sizes: Sizes, direction: Direction): Positions {
  const rows: Key[][] = [];
  for (const [key, rank] of ranksOf(graph)) {
    rows[rank] ??= [];
    rows[rank].push(key);
  }
  const right = direction === "right";
  const along = ({ width, height }: Size) => (right ? width : height);
  const across = ({ width, height }: Size) => (right ? height : width);
  const places: Positions = new Map();
  let from = 0;
  for (const row of rows) {
    const boxes = (row ?? []).map((key) => [key, sizeOf(key, sizes, direction)] as const);
    const wide = boxes.reduce((sum, [, size]) => sum + across(size) + GAP.across, -GAP.across);
    const deep = Math.max(0, ...boxes.map(([, size]) => along(size)));
    let at = -wide / 2;
    for (const [key, size] of boxes) {
      const start = from + (right ? 0 : (deep - along(size)) / 2);
      const [x, y] = right ? [start, at] : [at, start];
      places.set(key, [Math.round(x), Math.round(y)]);
      at += across(size) + GAP.across;
    }
    from += deep + GAP.along;
  }
  return places;
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
