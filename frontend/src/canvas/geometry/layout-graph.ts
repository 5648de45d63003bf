/** A graph as the layout library wants it, and its answer as places. Pure; `layout.ts` runs it. */
import type { ElkExtendedEdge, ElkNode, ElkPort, LayoutOptions } from "elkjs/lib/elk-api";
import { ENTRY, EXIT, type Graph, type Key } from "../../graph/model";
import { type Bundle, bundlesOf, pillSizeOf } from "../arrows/bundles";
import {
  CARD,
  estimatedSizes,
  forward,
  freeSpot,
  orderOf,
  type Positions,
  pillSize,
  ranksOf,
  relationsInOrder,
  type Size,
  type Sizes,
} from "./arrange";

/** Between rows; columns are a pill and `LAYERS` apart. */
const ROWS = 44;
const LAYERS = 40;
/** Above this many the thorough placement takes too long, and so do lines that only hold the ends. */
const THOROUGH = 90;
/** What would be longer than this, px, is wrapped: five cards in a row are not. */
const LONGEST = { right: 1_850, down: 1_250 } as const;
/** As wide as it shall be when it is wrapped, as a part of its height. */
const ASPECT = 1.5;

/** Between ports, px. */
const APART = 4;

const OPTIONS: LayoutOptions = {
  "elk.algorithm": "layered",
  "elk.edgeRouting": "ORTHOGONAL",
  "elk.separateConnectedComponents": "false",
  "elk.layered.feedbackEdges": "true",
  // GREEDY turns loops round: what leads back would lead on.
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

/** Pairs that hold the entry before everything and the exit behind: nothing is drawn of them. */
function holds(graph: Graph, tied: ReadonlySet<Key>): [Key, Key][] {
  const next = forward(graph);
  const led = new Set([...next.values()].flat());
  const ending = new Set(graph.relations.flatMap((r) => (r.child === EXIT ? [r.parent] : [])));
  return graph.actions
    .filter(({ key }) => tied.has(key))
    .flatMap(({ key }): [Key, Key][] => [
      ...(led.has(key) ? [] : [[ENTRY, key] as [Key, Key]]),
      ...(next.get(key)?.length || ending.has(key) ? [] : [[key, EXIT] as [Key, Key]]),
    ]);
}

/**
 * px before a pill and behind it that its line needs to be free to turn, with what the grid of lines
 * may take away on both sides: less, and pills that have no room beside their cards stand elsewhere.
 */
const BESIDE_PILL = 24;

/** The port of a bundle is as large as its pill, so that there is room for that before any bend. */
function portSize(bundle: Bundle, right: boolean): Size {
  const pill = pillSizeOf(bundle, false);
  if (pill === null) return { width: 1, height: 1 };
  const { width, height } = pill;
  return right ? { width: width + BESIDE_PILL, height } : { width, height: height + BESIDE_PILL };
}

const POINT: Size = { width: 1, height: 1 };

/**
 * The port at which a line arrives is as wide across as the one that it left, where all have room:
 * both sides of a card are divided alike then, and cards one after the other stand level.
 */
function arrivalSizes(lines: readonly Bundle[], sizes: Sizes, right: boolean) {
  const across = (line: Bundle): Size => {
    const { width, height } = portSize(line, right);
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

/** About how long it becomes in one piece, px. */
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
  /** The keys of its nodes, by their ids. */
  readonly keys: ReadonlyMap<string, Key>;
  /** What no arrow leads to or from stands in rows of its own below. */
  readonly loose: readonly Key[];
  /** What they need with the pills of lines that lead back to themselves. */
  readonly room: Sizes;
  readonly sizes: Sizes;
}

/** What the library is asked. Equal graphs ask the same, whatever their keys are. */
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
  const arrivals = arrivalSizes(lines, sizes, right);
  const edges = lines.map((line, i): ElkExtendedEdge => {
    port(line.source, `o${i}`, portSize(line, right), right ? "EAST" : "SOUTH");
    port(line.target, `i${i}`, arrivals(line), right ? "WEST" : "NORTH");
    return { id: `e${i}`, sources: [`o${i}`], targets: [`i${i}`] };
  });
  // The library draws no line from a card to itself: it keeps the room for its pills.
  const loops = loopsIn(graph);
  for (const [i, line] of loops.entries())
    port(line.source, `l${i}`, portSize(line, right), right ? "EAST" : "SOUTH");
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
  return { root, keys, loose, room: withLoops(sizes, loops, right), sizes };
}

const loopsIn = (graph: Graph): Bundle[] =>
  graph.relations.filter(({ parent, child }) => parent === child).flatMap(bundlesOf);

/** Sizes of cards with the pills of lines that lead from them to themselves. */
function withLoops(sizes: Sizes, loops: readonly Bundle[], right: boolean): Sizes {
  const room = new Map(sizes);
  for (const line of loops) {
    const [card, pill] = [sizes.get(line.source) ?? CARD, portSize(line, right)];
    const before = room.get(line.source) ?? card;
    room.set(line.source, {
      width: Math.max(before.width, card.width + (right ? pill.width : 0)),
      height: Math.max(before.height, card.height + (right ? 0 : pill.height)),
    });
  }
  return room;
}

/** The places in an answer. The entry of a new graph stands at 0, 0 or near it. */
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

/** The same in one piece; null when it is. */
export function withoutWrapping(root: ElkNode): ElkNode | null {
  const { "elk.layered.wrapping.strategy": wrapping, ...layoutOptions } = root.layoutOptions ?? {};
  return wrapping === undefined ? null : { ...root, layoutOptions };
}
