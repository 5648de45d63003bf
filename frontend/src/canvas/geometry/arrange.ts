/** Where things stand: places from the graph, and top-to-bottom ones for what has none. */
import { Graph as Dagre, layout } from "@dagrejs/dagre";
import { ENTRY, EXIT, type Graph, type Key, type Position } from "../../graph/model";

export const CARD = { width: 208, height: 104 } as const;
/** The ends are as wide as cards, so that the same x means the same middle. */
export const PILL = { width: 208, height: 32 } as const;

interface Size {
  readonly width: number;
  readonly height: number;
}
export type Sizes = ReadonlyMap<Key, Size>;
export type Positions = Map<Key, Position>;

function sizeOf(key: Key, sizes: Sizes): Size {
  return sizes.get(key) ?? (key === ENTRY || key === EXIT ? PILL : CARD);
}

/** Fresh places for everything, ranks from entry down to exit. */
export function arrange(
  graph: Graph,
  sizes: Sizes = new Map(),
  direction: "TB" | "LR" = "TB",
): Positions {
  const dagre = new Dagre({ multigraph: true });
  dagre.setGraph({ rankdir: direction, nodesep: 56, ranksep: 108, marginx: 0, marginy: 0 });
  dagre.setDefaultEdgeLabel(() => ({}));
  const keys = [ENTRY, ...graph.actions.map((action) => action.key), EXIT];
  for (const key of keys) dagre.setNode(key, { ...sizeOf(key, sizes) });
  graph.relations.forEach(({ parent, child }, i) => {
    if (parent === child || !dagre.hasNode(parent) || !dagre.hasNode(child)) return;
    dagre.setEdge(parent, child, { weight: parent === ENTRY ? 3 : 1 }, String(i));
  });
  layout(dagre);
  const places: Positions = new Map();
  for (const key of keys) {
    const { x = 0, y = 0 } = dagre.node(key);
    const { width, height } = sizeOf(key, sizes);
    places.set(key, [Math.round(x - width / 2), Math.round(y - height / 2)]);
  }
  return places;
}

/** How far the fresh places of what stands already are from where it stands. */
function offset(known: Positions, fresh: Positions): Position {
  let [dx, dy, n] = [0, 0, 0];
  for (const [key, [x, y]] of known) {
    const at = fresh.get(key);
    if (!at) continue;
    dx += x - at[0];
    dy += y - at[1];
    n += 1;
  }
  return n === 0 ? [0, 0] : [Math.round(dx / n), Math.round(dy / n)];
}

function knownPlaces(graph: Graph): Positions {
  const known: Positions = new Map();
  for (const { key, position } of graph.actions) if (position) known.set(key, position);
  if (graph.entryPosition) known.set(ENTRY, graph.entryPosition);
  if (graph.exitPosition) known.set(EXIT, graph.exitPosition);
  return known;
}

/**
 * Where what has no place of its own is drawn. Written down before somebody places one thing by
 * hand, so that the rest does not move. Nothing when every action has a place.
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

/** The middle of what an end is tied to; before anything is, it stays over the first action. */
function middle(graph: Graph, end: Key, places: Positions): number {
  const tied = graph.relations.flatMap((r) =>
    end === ENTRY && r.parent === ENTRY
      ? [r.child]
      : end === EXIT && r.child === EXIT
        ? [r.parent]
        : [],
  );
  const keys = tied.length > 0 ? tied : graph.actions.slice(0, 1).map((action) => action.key);
  const xs = keys.flatMap((key) => places.get(key)?.[0] ?? []);
  const sum = xs.reduce((total, x) => total + x, 0);
  return (xs.length === 0 ? 0 : sum / xs.length) + CARD.width / 2 - PILL.width / 2;
}

/** Where everything stands. What has a place keeps it. */
export function positionsOf(graph: Graph, sizes: Sizes = new Map()): Positions {
  const known = knownPlaces(graph);
  if (known.size === 0) return arrange(graph, sizes);
  const places: Positions = new Map(known);
  if (graph.actions.some((action) => !known.has(action.key))) {
    const fresh = arrange(graph, sizes);
    const [dx, dy] = offset(known, fresh);
    for (const { key } of graph.actions) {
      const at = fresh.get(key);
      if (!places.has(key) && at) places.set(key, [at[0] + dx, at[1] + dy]);
    }
  }
  const ys = graph.actions.flatMap(({ key }) => {
    const at = places.get(key);
    return at ? [[at[1], at[1] + sizeOf(key, sizes).height] as const] : [];
  });
  const top = Math.min(...ys.map(([y]) => y), Number.POSITIVE_INFINITY);
  const bottom = Math.max(...ys.map(([, y]) => y), Number.NEGATIVE_INFINITY);
  if (!places.has(ENTRY)) {
    places.set(ENTRY, [middle(graph, ENTRY, places), Number.isFinite(top) ? top - 92 : 0]);
  }
  if (!places.has(EXIT)) {
    places.set(EXIT, [middle(graph, EXIT, places), Number.isFinite(bottom) ? bottom + 64 : 220]);
  }
  return places;
}
