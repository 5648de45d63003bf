/** The input of the router: cards, lines, and the grid on which lines run. Pure. */

import type { Direction } from "../../graph/model";

export interface PillSize {
  readonly width: number;
  readonly height: number;
  /** The width with nothing but outcomes and response, for where there is no room; absent if that is all. */
  readonly lean?: number;
}

export interface Area extends Omit<PillSize, "lean"> {
  readonly x: number;
  readonly y: number;
}

export type Point = readonly [x: number, y: number];

export interface SceneCard extends Area {
  readonly key: string;
}

export interface SceneLine {
  readonly id: string;
  readonly source: string;
  readonly target: string;
  /** The size of its pill; null if it has none. */
  readonly pill: PillSize | null;
  /** Places through which people have led it. */
  readonly waypoints?: readonly Point[];
}

/** The input of one routing; it can be sent to a worker. */
export interface Scene {
  /** Lines leave cards at this side and enter them at the opposite one. */
  readonly direction: Direction;
  /** The start of the grid across the direction, 0 to 11 px. */
  readonly offset: number;
  readonly cards: readonly SceneCard[];
  /** The lines; their order decides how lines of one card lie beside each other if nothing else does. */
  readonly lines: readonly SceneLine[];
}

/** px; lines run on a grid of this step, hence are at least this far apart or lie on each other. */
export const STEP = 12;
/** px kept between lines and cards where there is room; a gap of 32 px contains a line of the grid. */
export const CLEARANCE = { wish: 16, least: 10 } as const;

/** A box in coordinates along (`u`) and across (`v`) the direction of the graph. */
export interface FlowBox {
  readonly u0: number;
  readonly u1: number;
  readonly v0: number;
  readonly v1: number;
}

/** Return an area in coordinates along and across the direction. */
export function boxOf({ x, y, width, height }: Area, direction: Direction): FlowBox {
  return direction === "right"
    ? { u0: x, u1: x + width, v0: y, v1: y + height }
    : { u0: y, u1: y + height, v0: x, v1: x + width };
}

/** Return the canvas point of coordinates along and across the direction. */
export const pointOf = (u: number, v: number, direction: Direction): Point =>
  direction === "right" ? [u, v] : [v, u];

/**
 * Return the offset of the grid for which most cards have their middle on it, so that lines between
 * cards in a row are straight. `before` stays unless another offset is much better.
 */
export function gridOffset(
  cards: readonly SceneCard[],
  direction: Direction,
  before: number | null,
): number {
  const counts = new Array<number>(STEP).fill(0);
  for (const card of cards) {
    const { v0, v1 } = boxOf(card, direction);
    const at = (((Math.round((v0 + v1) / 2) % STEP) + STEP) % STEP) | 0;
    counts[at] = (counts[at] ?? 0) + 1;
  }
  const best = counts.indexOf(Math.max(...counts));
  if (before === null) return best;
  return (counts[best] ?? 0) > 1.5 * (counts[before] ?? 0) ? best : before;
}

/** A waypoint on the grid. */
export interface GridPoint {
  readonly column: number;
  readonly row: number;
}

/** Return the point of the grid that is nearest to a canvas point. */
export function gridPoint([x, y]: Point, { direction, offset }: Scene): GridPoint {
  const [u, v] = direction === "right" ? [x, y] : [y, x];
  return { column: Math.round(u / STEP), row: Math.round((v - offset) / STEP) };
}

const CELL = 256; // px, the side of a bucket
const ROW = 2 ** 21; // buckets; boxes that are farther apart may share a bucket, which is harmless

const cellOf = (at: number) => Math.floor(at / CELL);

/** A spatial index of boxes. */
export class BoxIndex<T extends FlowBox> {
  private readonly buckets = new Map<number, T[]>();

  add(box: T): void {
    for (let i = cellOf(box.u0); i <= cellOf(box.u1); i += 1) {
      for (let j = cellOf(box.v0); j <= cellOf(box.v1); j += 1) {
        const bucket = this.buckets.get(i * ROW + j);
        if (bucket) bucket.push(box);
        else this.buckets.set(i * ROW + j, [box]);
      }
    }
  }

  /** Return whether any box except `leaveOut` comes closer than `gap` to a box. */
  hits(box: FlowBox, gap: number, leaveOut?: T): boolean {
    const wide = { u0: box.u0 - gap, u1: box.u1 + gap, v0: box.v0 - gap, v1: box.v1 + gap };
    for (let i = cellOf(wide.u0); i <= cellOf(wide.u1); i += 1) {
      for (let j = cellOf(wide.v0); j <= cellOf(wide.v1); j += 1) {
        for (const other of this.buckets.get(i * ROW + j) ?? [])
          if (other !== leaveOut && overlaps(wide, other)) return true;
      }
    }
    return false;
  }
}

function overlaps(a: FlowBox, b: FlowBox): boolean {
  return a.u0 < b.u1 && b.u0 < a.u1 && a.v0 < b.v1 && b.v0 < a.v1;
}
