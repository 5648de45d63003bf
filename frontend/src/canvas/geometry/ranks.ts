/**
 * Simple places by rank: a row or column for each. They need nothing but the ends of arrows, so that
 * thumbnails can use them, too.
 */
import {
  type Action,
  type Direction,
  ENTRY,
  EXIT,
  type Key,
  type Position,
  type Relation,
} from "../../graph/model";

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
export const SHORT_PILL = { width: 84, height: 32 } as const;
/** px kept free between cards that have not been laid out. */
export const GAP = { along: 108, across: 56 } as const;

/** Return the size of the entry and exit of a graph. */
export const pillSize = (direction: Direction): Size => (direction === "right" ? SHORT_PILL : PILL);

/** Return the size of an element; one that is not known has that of a card. */
export function sizeOf(key: Key, sizes: Sizes, direction: Direction): Size {
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
