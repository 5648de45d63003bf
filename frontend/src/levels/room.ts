/** Moves everything apart as far as expanded cards need, and maps places between the canvas and the document. Pure. */
import type { Folding } from "../canvas/folding/folding";
import type { PlaceMap, Spread, StandingGraph } from "../canvas/folding/spread";
import { cardSize, type Positions, type Sizes } from "../canvas/geometry/arrange";
import { notesOf } from "../graph/edit/notes";
import type { Graph, JsonText, Key, Position, Relation } from "../graph/model";
import { readWaypoints } from "../graph/waypoints";

/** From `from` to `to` there have to be `by` px more. */
interface Stretch {
  readonly from: number;
  readonly to: number;
  readonly by: number;
}

interface Axis {
  /** Where on the canvas something is drawn. */
  toView(at: number): number;
  /** Where it stands in the document: the other way round. */
  toDocument(at: number): number;
}

/** The last of ascending numbers that is no greater; -1: there is none. */
function lastUpTo(numbers: readonly number[], value: number): number {
  let [low, high] = [0, numbers.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((numbers[middle] ?? 0) <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** From ascending places to ascending places, evenly in between, and as they are on either side. */
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
 * What stands after a stretch makes way by no more than it has to; two stretches beside each other share
 * the room. No distance ever shrinks, so that what does not overlap in the document does not here.
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

/** Frames are as large as what they stand round. */
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

/** A graph with larger cards in it. */
interface Roomy {
  /** With its waypoints and frames as they are drawn. */
  readonly graph: Graph;
  /** Of the larger cards. */
  readonly sizes: Sizes;
  readonly toView: PlaceMap;
  readonly toDocument: PlaceMap;
}

/** `sizes`: of the cards that are to be larger. Null where none of them is drawn. */
export function roomFor(
  graph: Graph,
  rest: Positions,
  sizes: Sizes,
  hidden?: ReadonlyMap<Key, string>,
): Roomy | null {
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

export const placesIn = ({ toView }: Roomy, places: Positions): Positions =>
  new Map([...places].map(([key, at]) => [key, toView(at)]));

/** What is folded, as it is drawn. */
function foldedIn(graph: Graph, folding: Folding): Folding {
  const drawn = new Map(notesOf(graph).map((note) => [note.key, note]));
  const blocks = [...folding.blocks].map(([key, note]) => [key, drawn.get(key) ?? note] as const);
  return { ...folding, blocks: new Map(blocks) };
}

const point = ([x, y]: Position) => ({ x, y });

/** The graph on the canvas with room for what is expanded in it. */
export function spreadOf(
  { graph, rest, folding, flow }: StandingGraph,
  sizes: Sizes,
): Spread | null {
  const roomy = roomFor(graph, rest, sizes, folding?.blockOf);
  if (roomy === null) return null;
  const { toView, toDocument } = roomy;
  return {
    graph: roomy.graph,
    folding: folding && foldedIn(roomy.graph, folding),
    expanded: roomy.sizes,
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
    placesOf: (places) => placesIn(roomy, places),
    sizesOf: (measured) => new Map([...measured, ...roomy.sizes]),
  };
}
