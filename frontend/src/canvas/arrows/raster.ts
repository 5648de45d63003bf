/** The grid of a scene: the points that cards and pills block, and the lines that use each of its steps. */
import { CLEARANCE, type FlowBox, STEP } from "./scene";

/** Kinds of points by their distance from cards; the nearer, the more expensive to pass. */
export const FREE = 0;
export const NEAR = 1;
export const TIGHT = 2;
export const BLOCKED = 3;

/** Scenes with more points keep simple lines: their cards stand very far apart. */
const MOST_CELLS = 4_000_000;
const MARGIN = 24; // steps around everything, for lines that lead around it
const PILL_GAP = 3; // px
const TOUCHING = 2; // px

/** px; waypoints farther from all cards are left out. */
const FAR = 200 * STEP;

function boundsOf(boxes: readonly FlowBox[]): FlowBox {
  const least = (of: (box: FlowBox) => number) =>
    boxes.reduce((n, b) => Math.min(n, of(b)), Infinity);
  return {
    u0: least(({ u0 }) => u0),
    v0: least(({ v0 }) => v0),
    u1: -least(({ u1 }) => -u1),
    v1: -least(({ v1 }) => -v1),
  };
}

const isNear = ({ u0, v0 }: FlowBox, bounds: FlowBox) =>
  u0 > bounds.u0 - FAR && u0 < bounds.u1 + FAR && v0 > bounds.v0 - FAR && v0 < bounds.v1 + FAR;

const fits = ({ u0, u1, v0, v1 }: FlowBox) =>
  ((u1 - u0) / STEP + 50) * ((v1 - v0) / STEP + 50) < MOST_CELLS;

/** The grid of one scene as flat arrays, indexed row by row. */
export class Raster {
  readonly width: number;
  readonly height: number;
  readonly ground: Uint8Array;
  /**
   * The number of lines on the step from each point along the direction, on the step across it, and
   * of turns at the point.
   */
  readonly along: Uint16Array;
  readonly across: Uint16Array;
  readonly turns: Uint16Array;
  private readonly column0: number;
  private readonly row0: number;
  private readonly offset: number;

  private constructor(bounds: FlowBox, offset: number) {
    this.offset = offset;
    this.column0 = Math.floor(bounds.u0 / STEP) - MARGIN;
    this.row0 = Math.floor((bounds.v0 - offset) / STEP) - MARGIN;
    this.width = Math.ceil(bounds.u1 / STEP) + MARGIN - this.column0 + 1;
    this.height = Math.ceil((bounds.v1 - offset) / STEP) + MARGIN - this.row0 + 1;
    const cells = this.width * this.height;
    this.ground = new Uint8Array(cells);
    this.along = new Uint16Array(cells);
    this.across = new Uint16Array(cells);
    this.turns = new Uint16Array(cells);
  }

  /**
   * Return the raster of a scene; null if it would be too large. `waypoints`: boxes that may lie
   * outside of all cards.
   */
  static of(
    cards: readonly FlowBox[],
    pills: readonly FlowBox[],
    offset: number,
    waypoints: readonly FlowBox[] = [],
  ): Raster | null {
    const bounds = boundsOf([...cards, ...pills]);
    const wide = boundsOf([bounds, ...waypoints.filter((point) => isNear(point, bounds))]);
    if (!fits(bounds)) return null;
    const raster = new Raster(fits(wide) ? wide : bounds, offset);
    for (const card of cards) {
      raster.keep(card, CLEARANCE.wish - 0.01, NEAR);
      raster.keep(card, CLEARANCE.least - 0.01, TIGHT);
      raster.keep(card, TOUCHING, BLOCKED);
    }
    for (const pill of pills) raster.keep(pill, PILL_GAP, BLOCKED);
    return raster;
  }

  private keep(box: FlowBox, gap: number, as: number): void {
    const { first, last, top, bottom } = this.cells(box, gap);
    for (let row = top; row <= bottom; row += 1) {
      for (let cell = row * this.width + first; cell <= row * this.width + last; cell += 1) {
        if ((this.ground[cell] ?? 0) < as) this.ground[cell] = as;
      }
    }
  }

  private cells({ u0, u1, v0, v1 }: FlowBox, gap: number) {
    return {
      first: Math.ceil((u0 - gap) / STEP) - this.column0,
      last: Math.floor((u1 + gap) / STEP) - this.column0,
      top: Math.ceil((v0 - gap - this.offset) / STEP) - this.row0,
      bottom: Math.floor((v1 + gap - this.offset) / STEP) - this.row0,
    };
  }

  /** Return whether a line passes through a box. */
  hasLine(box: FlowBox, gap: number): boolean {
    const { first, last, top, bottom } = this.cells(box, gap);
    for (let row = top; row <= bottom; row += 1) {
      for (let cell = row * this.width + first; cell <= row * this.width + last; cell += 1) {
        if (this.isUsed(cell)) return true;
      }
    }
    return false;
  }

  isUsed(cell: number): boolean {
    const { along, across, width } = this;
    return !!(along[cell] || along[cell - 1] || across[cell] || across[cell - width]);
  }

  /** Return the index of a point; -1 if it is outside of the raster. */
  cellAt(column: number, row: number): number {
    const [x, y] = [column - this.column0, row - this.row0];
    return x < 0 || y < 0 || x >= this.width || y >= this.height ? -1 : y * this.width + x;
  }

  columnOf(cell: number): number {
    return (cell % this.width) + this.column0;
  }

  rowOf(cell: number): number {
    return Math.floor(cell / this.width) + this.row0;
  }

  /** Return whether a line lies on one of the steps between these corners. */
  sharesStep(corners: readonly number[]): boolean {
    for (let i = 1; i < corners.length; i += 1) {
      const [a = 0, b = 0] = [corners[i - 1], corners[i]];
      const level = Math.floor(a / this.width) === Math.floor(b / this.width);
      const [step, layer] = level ? [1, this.along] : [this.width, this.across];
      for (let cell = Math.min(a, b); cell < Math.max(a, b); cell += step)
        if (layer[cell]) return true;
    }
    return false;
  }

  /** Add a line through these corners to the counts, or remove it if `by` is -1. */
  mark(corners: readonly number[], by: 1 | -1): void {
    for (let i = 1; i < corners.length; i += 1) {
      const [a = 0, b = 0] = [corners[i - 1], corners[i]];
      const level = Math.floor(a / this.width) === Math.floor(b / this.width);
      const [step, layer] = level ? [1, this.along] : [this.width, this.across];
      for (let cell = Math.min(a, b); cell < Math.max(a, b); cell += step)
        layer[cell] = (layer[cell] ?? 0) + by;
      if (i > 1) this.turns[a] = (this.turns[a] ?? 0) + by;
    }
  }
}
