/** Moves everything apart as far as expanded cards need, and maps places between the canvas and the document. Pure. */
import type { PlaceMap, Spread, StandingGraph } from "../canvas/editor-store";
import type { Folding } from "../canvas/elements";
import { cardSize } from "../canvas/geometry/arrange";
import type { Positions, Sizes } from "../canvas/geometry/ranks";
import { notesOf } from "../graph/edit/notes";
import type { Graph, JsonText, Key, Position, Relation } from "../graph/model";
import { readWaypoints } from "../graph/waypoints";

/** A part of an axis, `from` to `to`, that needs `by` px more. */
interface Stretch {
  readonly from: number;
  readonly to: number;
  readonly by: number;
}

interface Axis {
  /** Returns the place in the drawing of a place in the document. */
  toView(at: number): number;
  /** Returns the place in the document of a place in the drawing. */
  toDocument(at: number): number;
}

/**
 * Return the index of the last of ascending numbers that is not greater than a value; -1 if there
 * is none.
 */
function lastUpTo(numbers: readonly number[], value: number): number {
  let [low, high] = [0, numbers.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((numbers[middle] ?? 0) <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/**
 * Return a function that maps ascending places to ascending places: linear between them, constant
 * offsets outside.
 */
function along(from: readonly number[], to: readonly number[]) {
  return (at: number): number => {
    const i = lastUpTo(from, at);
    const [a, b] = [from[i], from[i + 1]];
    const [start, end] = [to[i], to[i + 1]];
    if (a === undefined || start === undefined) return at;
    if (b === undefined || end === undefined) return at + start - a;
    return start + ((at - a) * (end - start)) / (b - a);
  };
}

/**
 * Return the mapping of an axis with stretches. Everything behind a stretch moves by no more than
 * it must; stretches at the same place share the room. No distance shrinks, so what does not
 * overlap in the document does not overlap in the drawing.
 */
export function axisOf(stretches: readonly Stretch[]): Axis {
  const places = [...new Set(stretches.flatMap(({ from, to }) => [from, to]))].sort(
    (a, b) => a - b,
  );
  const ending = new Map<number, Stretch[]>(places.map((place) => [place, []]));
  for (const stretch of stretches) ending.get(stretch.to)?.push(stretch);
  const moved = new Map<number, number>();
  let most = 0;
  for (const place of places) {
    for (const { from, by } of ending.get(place) ?? [])
      most = Math.max(most, (moved.get(from) ?? 0) + by);
    moved.set(place, most);
  }
  const views = places.map((place) => place + (moved.get(place) ?? 0));
  return { toView: along(places, views), toDocument: along(views, places) };
}

function ledThrough(relation: Relation, toView: PlaceMap): Relation {
  if (relation.waypoints.length === 0) return relation;
  const waypoints = relation.waypoints.map(([response, text]) => {
    const places = readWaypoints(text);
    return [response, places.length === 0 ? text : JSON.stringify(places.map(toView))] as const;
  });
  return { ...relation, waypoints };
}

/** Return the notes with frames around the same elements as in the document. */
function framed(graph: Graph, toView: PlaceMap): Graph["notes"] {
  const frames = new Map(
    notesOf(graph).flatMap((note) => {
      const { key, kind, at, size } = note;
      if (kind !== "frame") return [];
      const [from, to] = [toView(at), toView([at[0] + size[0], at[1] + size[1]])];
      return [[key, { at: from, size: [to[0] - from[0], to[1] - from[1]] }] as const];
    }),
  );
  if (frames.size === 0) return graph.notes;
  return graph.notes.map(([id, text]): readonly [string, JsonText] => {
    const frame = frames.get(`g/${id}`);
    return frame ? [id, JSON.stringify({ ...JSON.parse(text), ...frame })] : [id, text];
  });
}

/** A graph with room for enlarged cards. */
interface EnlargedGraph {
  /** The graph with its waypoints and frames as they are drawn. */
  readonly graph: Graph;
  /** Sizes of the enlarged cards. */
  readonly sizes: Sizes;
  readonly toView: PlaceMap;
  readonly toDocument: PlaceMap;
}

/** Return a graph with room for enlarged cards of these `sizes`; null if none of them is drawn. */
export function roomFor(
  graph: Graph,
  rest: Positions,
  sizes: Sizes,
  hidden?: ReadonlyMap<Key, string>,
): EnlargedGraph | null {
  const closed = new Map(
    graph.actions.flatMap((action) =>
      sizes.has(action.key) && rest.has(action.key) && !hidden?.has(action.key)
        ? [[action.key, cardSize(action, graph.direction)] as const]
        : [],
    ),
  );
  if (closed.size === 0) return null;
  const stretches = (i: 0 | 1, side: "width" | "height"): Stretch[] =>
    [...closed].map(([key, size]) => {
      const from = rest.get(key)?.[i] ?? 0;
      const by = Math.max(0, (sizes.get(key) ?? size)[side] - size[side]);
      return { from, to: from + size[side], by };
    });
  const [across, down] = [axisOf(stretches(0, "width")), axisOf(stretches(1, "height"))];
  const toView: PlaceMap = ([x, y]) => [Math.round(across.toView(x)), Math.round(down.toView(y))];
  const toDocument: PlaceMap = ([x, y]) => [across.toDocument(x), down.toDocument(y)];
  const relations = graph.relations.map((relation) => ledThrough(relation, toView));
  const drawn = { ...graph, relations, notes: framed(graph, toView) };
  const larger = new Map([...sizes].filter(([key]) => closed.has(key)));
  return { graph: drawn, sizes: larger, toView, toDocument };
}

/** Return the drawn places of places in the document. */
export const placesIn = ({ toView }: EnlargedGraph, places: Positions): Positions =>
  new Map([...places].map(([key, at]) => [key, toView(at)]));

/** Return the folded frames with the places and sizes as they are drawn. */
function foldedIn(graph: Graph, folding: Folding): Folding {
  const drawn = new Map(notesOf(graph).map((note) => [note.key, note]));
  const blocks = [...folding.blocks].map(([key, note]) => [key, drawn.get(key) ?? note] as const);
  return { ...folding, blocks: new Map(blocks) };
}

const point = ([x, y]: Position) => ({ x, y });

/** Return the graph on the canvas with room for its expanded cards; null if none is drawn. */
export function spreadOf(
  { graph, rest, folding, flow }: StandingGraph,
  sizes: Sizes,
): Spread | null {
  const enlarged = roomFor(graph, rest, sizes, folding?.blockOf);
  if (enlarged === null) return null;
  const { toView, toDocument } = enlarged;
  return {
    graph: enlarged.graph,
    folding: folding && foldedIn(enlarged.graph, folding),
    expanded: enlarged.sizes,
    flow: {
      ...flow,
      screenToFlowPosition: (at, options) => {
        const { x, y } = flow.screenToFlowPosition(at, options);
        return point(toDocument([x, y]));
      },
      flowToScreenPosition: ({ x, y }) => flow.flowToScreenPosition(point(toView([x, y]))),
    },
    toView,
    toDocument,
    placesOf: (places) => placesIn(enlarged, places),
    sizesOf: (measured) => new Map([...measured, ...enlarged.sizes]),
  };
}
