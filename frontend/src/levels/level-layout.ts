/** Computes places and lines within an expanded graph, and the size of its card. Pure. */
import { type Bundle, bundlesOf, handOversIn, pillSizeOf } from "../canvas/arrows/bundles";
import { routed } from "../canvas/arrows/routes";
import { gridOffset, type Scene, type SceneCard } from "../canvas/arrows/scene";
import { type LineMap, type RoutedLine, simpleLines } from "../canvas/arrows/simple-lines";
import type { LevelGraph } from "../canvas/editor-store";
import { estimatedSizes, positionsOf } from "../canvas/geometry/arrange";
import type { Positions, Size } from "../canvas/geometry/ranks";
import { type Action, type Direction, ENTRY, EXIT, type Graph, type Key } from "../graph/model";
import { type HandOver, robotOf } from "../graph/robots";
import { placesIn, roomFor } from "./room";

interface LevelCard extends Size {
  readonly action: Action;
  readonly x: number;
  readonly y: number;
}

interface LevelLine {
  readonly bundle: Bundle;
  readonly hand: HandOver | null;
  readonly line: RoutedLine;
}

export interface LevelLayout {
  readonly size: Size;
  readonly direction: Direction;
  readonly cards: readonly LevelCard[];
  readonly lines: readonly LevelLine[];
}

/** Measures of `level-frame.module.css`, px: the height of the head, and the space around the cards. */
const HEAD = 38;
const AIR = { along: 56, across: 26 } as const;
/** px; the size of the points at the edge of the frame that stand for entry and exit. */
const DOT = 8;
/** The size of a graph that is not loaded or has no actions. */
const EMPTY: Size = { width: 260, height: HEAD + 84 };
const LEAST_WIDTH = 260;
/** More lines than this keep simple ways: the page would wait for the router. */
const MOST_ROUTED = 200;

const known = new WeakMap<LevelGraph, LevelLayout>();

/** Return the layout of an expanded graph. It is cached, since few levels change at once. */
export function layoutOf(level: LevelGraph): LevelLayout {
  const before = known.get(level);
  if (before) return before;
  const { graph } = level;
  const isThere = graph !== null && typeof graph !== "string" && graph.actions.length > 0;
  const layout = isThere ? laidOut(graph, level) : NOTHING;
  known.set(level, layout);
  return layout;
}

const NOTHING: LevelLayout = { size: EMPTY, direction: "right", cards: [], lines: [] };

/** Return the cards with their places and sizes, and the graph with its waypoints as they are drawn. */
function cardsOf(given: Graph, { levels }: LevelGraph) {
  const closed = estimatedSizes(given);
  const rest = positionsOf(given, closed);
  const sizes = new Map<Key, Size>([...levels].map(([key, each]) => [key, layoutOf(each).size]));
  const enlarged = roomFor(given, rest, sizes);
  const graph = enlarged?.graph ?? given;
  const places: Positions = enlarged ? placesIn(enlarged, rest) : rest;
  const cards = graph.actions.map((action): LevelCard => {
    const [x, y] = places.get(action.key) ?? [0, 0];
    const size = sizes.get(action.key) ?? closed.get(action.key) ?? EMPTY;
    return { action, x, y, ...size };
  });
  return { graph, cards };
}

function boundsOf(cards: readonly LevelCard[]) {
  const [left, top] = [Math.min(...cards.map(({ x }) => x)), Math.min(...cards.map(({ y }) => y))];
  const right = Math.max(...cards.map(({ x, width }) => x + width));
  const bottom = Math.max(...cards.map(({ y, height }) => y + height));
  return { left, top, width: right - left, height: bottom - top };
}

/**
 * Return the points at the edge of the frame at which arrows from the entry start and arrows to the
 * exit end.
 */
function endsOf(direction: Direction, { width, height }: Size): SceneCard[] {
  const dot = { width: DOT, height: DOT };
  const [middle, half] = [Math.round((HEAD + height) / 2 - DOT / 2), Math.round((width - DOT) / 2)];
  return direction === "right"
    ? [
        { key: ENTRY, x: -DOT, y: middle, ...dot },
        { key: EXIT, x: width, y: middle, ...dot },
      ]
    : [
        { key: ENTRY, x: half, y: HEAD - DOT, ...dot },
        { key: EXIT, x: half, y: height, ...dot },
      ];
}

function linesOf(
  graph: Graph,
  cards: readonly LevelCard[],
  size: Size,
  moved: readonly [number, number],
) {
  const { direction } = graph;
  const standing = new Set<Key>([ENTRY, EXIT, ...cards.map(({ action }) => action.key)]);
  const bundles = graph.relations
    .filter(({ parent, child }) => standing.has(parent) && standing.has(child))
    .flatMap(bundlesOf);
  const handOf = handOversIn(graph.relations, robotOf(graph));
  const boxes: SceneCard[] = [
    ...endsOf(direction, size),
    ...cards.map(({ action: { key }, x, y, width, height }) => ({ key, x, y, width, height })),
  ];
  const scene: Scene = {
    direction,
    offset: gridOffset(boxes, direction, null),
    cards: boxes,
    lines: bundles.map((bundle) => {
      const { id, source, target } = bundle;
      const waypoints = bundle.waypoints.map(([x, y]) => [x + moved[0], y + moved[1]] as const);
      const pill = pillSizeOf(bundle, false, handOf(bundle) !== null);
      return { id, source, target, pill, waypoints };
    }),
  };
  const lines: LineMap = bundles.length > MOST_ROUTED ? simpleLines(scene) : routed(scene).lines;
  return bundles.flatMap((bundle) => {
    const line = lines.get(bundle.id);
    return line ? [{ bundle, hand: handOf(bundle), line }] : [];
  });
}

function laidOut(given: Graph, level: LevelGraph): LevelLayout {
  const { graph, cards } = cardsOf(given, level);
  const { direction } = graph;
  const bounds = boundsOf(cards);
  const [across, down] = direction === "right" ? [AIR.along, AIR.across] : [AIR.across, AIR.along];
  const size = {
    width: Math.max(LEAST_WIDTH, bounds.width + 2 * across),
    height: HEAD + bounds.height + 2 * down,
  };
  const [dx, dy] = [across - bounds.left, HEAD + down - bounds.top];
  const placed = cards.map((card) => ({ ...card, x: card.x + dx, y: card.y + dy }));
  return { size, direction, cards: placed, lines: linesOf(graph, placed, size, [dx, dy]) };
}
