/** Turns a graph into the input of elkjs, and its output into places. Pure; `layout.ts` runs it. */
import type { ElkExtendedEdge, ElkNode, ElkPort, LayoutOptions } from "elkjs/lib/elk-api";
import { ENTRY, EXIT, type Graph, type Key } from "../../graph/model";
import { robotOf } from "../../graph/robots";
import { type Bundle, bundlesOf, handOversIn, pillSizeOf } from "../arrows/bundles";
import { estimatedSizes, freeSpot } from "./arrange";
import {
  CARD,
  forward,
  orderOf,
  type Positions,
  pillSize,
  ranksOf,
  relationsInOrder,
  type Size,
  type Sizes,
} from "./ranks";

/** px between rows; between columns there are LAYERS px and a pill. */
const ROWS = 44;
const LAYERS = 40;
/**
 * A limit in actions: beyond it the thorough placement and the edges that only hold entry and exit
 * take too long.
 */
const THOROUGH = 90;
/** px; longer graphs are wrapped. Five cards in a row are not longer. */
const LONGEST = { right: 1_850, down: 1_250 } as const;
/** The width of a wrapped graph relative to its height. */
const ASPECT = 1.5;

/** The distance between ports, px. */
const APART = 4;

const OPTIONS: LayoutOptions = {
  "elk.algorithm": "layered",
  "elk.edgeRouting": "ORTHOGONAL",
  "elk.separateConnectedComponents": "false",
  "elk.layered.feedbackEdges": "true",
  // GREEDY reverses loops, so that arrows back would lead forward.
  "elk.layered.cycleBreaking.strategy": "DEPTH_FIRST",
  "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
  "elk.layered.nodePlacement.favorStraightEdges": "true",
  "elk.spacing.nodeNode": String(ROWS),
  "elk.layered.spacing.nodeNodeBetweenLayers": String(LAYERS),
  "elk.spacing.edgeNode": "16",
  "elk.layered.spacing.edgeNodeBetweenLayers": "16",
  "elk.spacing.edgeEdge": "12",
  "elk.layered.spacing.edgeEdgeBetweenLayers": "12",
  "elk.spacing.portPort": String(APART),
};

/** Return pairs of elements to connect invisibly, so that the entry comes first and the exit last. */
function holds(graph: Graph, tied: ReadonlySet<Key>): [Key, Key][] {
  const next = forward(graph);
  const reached = new Set([...next.values()].flat());
  const ending = new Set(graph.relations.flatMap((r) => (r.child === EXIT ? [r.parent] : [])));
  return graph.actions
    .filter(({ key }) => tied.has(key))
    .flatMap(({ key }): [Key, Key][] => [
      ...(reached.has(key) ? [] : [[ENTRY, key] as [Key, Key]]),
      ...(next.get(key)?.length || ending.has(key) ? [] : [[key, EXIT] as [Key, Key]]),
    ]);
}

/**
 * px before and behind a pill in which its line can turn, plus what the grid of lines may take on
 * both sides. With less, pills would not fit beside their cards.
 */
const BESIDE_PILL = 24;

type PortSize = (bundle: Bundle) => Size;

/**
 * Return a function for the size of a bundle's port: that of its pill, which then has room before
 * the first bend.
 */
function portSizes(graph: Graph, right: boolean): PortSize {
  const handOf = handOversIn(graph.relations, robotOf(graph));
  return (bundle) => {
    const pill = pillSizeOf(bundle, false, handOf(bundle) !== null);
    if (pill === null) return { width: 1, height: 1 };
    const { width, height } = pill;
    return right ? { width: width + BESIDE_PILL, height } : { width, height: height + BESIDE_PILL };
  };
}

const POINT: Size = { width: 1, height: 1 };

/**
 * Return a function for the size of the port at which a line arrives. Where there is room it is as
 * wide as the port that the line left: then both sides of a card are divided alike, and successive
 * cards stand level.
 */
function arrivalSizes(lines: readonly Bundle[], sizes: Sizes, portSize: PortSize, right: boolean) {
  const across = (line: Bundle): Size => {
    const { width, height } = portSize(line);
    return right ? { width: 1, height } : { width, height: 1 };
  };
  const taken = new Map<Key, number>();
  for (const line of lines) {
    const { width, height } = across(line);
    taken.set(line.target, (taken.get(line.target) ?? 0) + (right ? height : width) + APART);
  }
  return (line: Bundle): Size => {
    const { width, height } = sizes.get(line.target) ?? CARD;
    return (taken.get(line.target) ?? 0) + APART <= (right ? height : width) ? across(line) : POINT;
  };
}

/** Estimate the length of a graph that is not wrapped, px. */
function lengthOf(graph: Graph, sizes: Sizes): number {
  const right = graph.direction === "right";
  const deepest: number[] = [];
  for (const [key, rank] of ranksOf(graph)) {
    const { width, height } = sizes.get(key) ?? CARD;
    deepest[rank] = Math.max(deepest[rank] ?? 0, right ? width : height);
  }
  const between = LAYERS + (right ? 50 : 36);
  return deepest.reduce((sum, depth) => sum + depth + between, -between);
}

function optionsFor(graph: Graph, sizes: Sizes): LayoutOptions {
  const right = graph.direction === "right";
  const thorough = graph.actions.length <= THOROUGH;
  return {
    ...OPTIONS,
    "elk.direction": right ? "RIGHT" : "DOWN",
    "elk.layered.nodePlacement.strategy": thorough ? "NETWORK_SIMPLEX" : "BRANDES_KOEPF",
    ...(lengthOf(graph, sizes) > LONGEST[graph.direction]
      ? { "elk.layered.wrapping.strategy": "MULTI_EDGE", "elk.aspectRatio": String(ASPECT) }
      : {}),
  };
}

export interface LayoutRequest {
  readonly root: ElkNode;
  /** Keys of the nodes by their ids. */
  readonly keys: ReadonlyMap<string, Key>;
  /** Elements without arrows, which get rows of their own below. */
  readonly loose: readonly Key[];
  /** Sizes of cards including the pills of arrows that lead back to the same card. */
  readonly room: Sizes;
  readonly sizes: Sizes;
}

/** Return the input of elkjs. Equal graphs give equal inputs, whatever their keys are. */
export function layoutRequest(graph: Graph, measured: Sizes): LayoutRequest {
  const sizes = new Map([...estimatedSizes(graph), ...measured]);
  for (const end of [ENTRY, EXIT]) {
    if (!measured.has(end)) sizes.set(end, pillSize(graph.direction));
  }
  const order = orderOf(graph);
  const lines = relationsInOrder(graph, order).flatMap(bundlesOf);
  const tied = new Set([ENTRY, EXIT, ...lines.flatMap(({ source, target }) => [source, target])]);
  const right = graph.direction === "right";
  const ports = new Map<Key, ElkPort[]>();
  const port = (key: Key, id: string, size: Size, side: string) => {
    const list = ports.get(key) ?? [];
    ports.set(key, list);
    list.push({ id, ...size, layoutOptions: { "elk.port.side": side } });
  };
  const portSize = portSizes(graph, right);
  const arrivals = arrivalSizes(lines, sizes, portSize, right);
  const edges = lines.map((line, i): ElkExtendedEdge => {
    port(line.source, `o${i}`, portSize(line), right ? "EAST" : "SOUTH");
    port(line.target, `i${i}`, arrivals(line), right ? "WEST" : "NORTH");
    return { id: `e${i}`, sources: [`o${i}`], targets: [`i${i}`] };
  });
  // elkjs draws no arrow from a card to itself: a port keeps the room for its pill.
  const loops = loopsIn(graph);
  for (const [i, line] of loops.entries())
    port(line.source, `l${i}`, portSize(line), right ? "EAST" : "SOUTH");
  const held = graph.actions.length <= THOROUGH ? holds(graph, tied) : [];
  for (const [i, [parent, child]] of held.entries()) {
    port(parent, `ho${i}`, POINT, right ? "EAST" : "SOUTH");
    port(child, `hi${i}`, POINT, right ? "WEST" : "NORTH");
    edges.push({ id: `h${i}`, sources: [`ho${i}`], targets: [`hi${i}`] });
  }
  const keys = new Map<string, Key>();
  const children = [...order].flatMap(([key, i]): ElkNode[] => {
    if (!tied.has(key)) return [];
    const id = `n${i}`;
    keys.set(id, key);
    const { width, height } = sizes.get(key) ?? CARD;
    const layer = key === ENTRY ? "FIRST" : key === EXIT ? "LAST" : null;
    return [
      {
        id,
        width,
        height,
        ports: ports.get(key) ?? [],
        layoutOptions: {
          "elk.portConstraints": "FIXED_SIDE",
          ...(layer ? { "elk.layered.layering.layerConstraint": layer } : {}),
        },
      },
    ];
  });
  const root: ElkNode = {
    id: "graph",
    layoutOptions: optionsFor(graph, sizes),
    children,
    edges,
  };
  const loose = [...order.keys()].filter((key) => !tied.has(key));
  return { root, keys, loose, room: withLoops(sizes, loops, portSize, right), sizes };
}

const loopsIn = (graph: Graph): Bundle[] =>
  graph.relations.filter(({ parent, child }) => parent === child).flatMap(bundlesOf);

/** Return the sizes of cards including the pills of arrows that lead back to the same card. */
function withLoops(
  sizes: Sizes,
  loops: readonly Bundle[],
  portSize: PortSize,
  right: boolean,
): Sizes {
  const room = new Map(sizes);
  for (const line of loops) {
    const [card, pill] = [sizes.get(line.source) ?? CARD, portSize(line)];
    const before = room.get(line.source) ?? card;
    room.set(line.source, {
      width: Math.max(before.width, card.width + (right ? pill.width : 0)),
      height: Math.max(before.height, card.height + (right ? 0 : pill.height)),
    });
  }
  return room;
}

/** Return the places in the output of elkjs. The entry of a new graph gets a place near 0, 0. */
export function placesIn({ keys, loose, room }: LayoutRequest, answer: ElkNode): Positions {
  const places: Positions = new Map();
  const boxes = (answer.children ?? []).flatMap(({ id, x = 0, y = 0, width = 0, height = 0 }) => {
    const key = keys.get(id);
    if (key === undefined) return [];
    const at = [Math.round(x), Math.round(y)] as const;
    places.set(key, at);
    return [{ x: at[0], y: at[1], width, height }];
  });
  const left = Math.min(...boxes.map(({ x }) => x), 0);
  const wide = Math.max(...boxes.map(({ x, width }) => x + width), 4 * CARD.width);
  let low = Math.max(...boxes.map(({ y, height }) => y + height), 0) + ROWS;
  let row: typeof boxes = [];
  for (const key of loose) {
    const size = room.get(key) ?? CARD;
    let at = freeSpot([left, low], size, row, "down");
    if (at[0] + size.width > wide && row.length > 0) {
      low = Math.max(...row.map(({ y, height }) => y + height)) + ROWS;
      row = [];
      at = [left, low];
    }
    places.set(key, at);
    row.push({ x: at[0], y: at[1], ...size });
  }
  return places;
}

/** Return the input without wrapping; null if it has none. */
export function withoutWrapping(root: ElkNode): ElkNode | null {
  const { "elk.layered.wrapping.strategy": wrapping, ...layoutOptions } = root.layoutOptions ?? {};
  return wrapping === undefined ? null : { ...root, layoutOptions };
}
