/** Computes viewports (offset and zoom) in which text stays readable. Pure. */
import type { Direction, Position } from "../../graph/model";
import type { Positions, Sizes } from "./ranks";
import { CARD } from "./ranks";

export interface Bounds {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** The offset of the canvas in px, and its zoom. */
export interface Viewport {
  readonly x: number;
  readonly y: number;
  readonly zoom: number;
}

/** px on screen that bars and drawers cover at each edge of the canvas. */
export interface Insets {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

export interface CanvasArea {
  readonly width: number;
  readonly height: number;
  /** The covered edges; without it only the tools at the bottom. */
  readonly covered?: Insets;
}

/** px on screen kept free around what is shown. */
const AIR = 28;
const TOOLS: Insets = { left: 0, top: 0, right: 0, bottom: 44 };
/** The least zoom at which all text on cards has at least 11 px on a desktop; on a phone, that of a large graph. */
export const READABLE = { desktop: 0.9, phone: 0.6 } as const;
/** The least zoom at which the names on cards, which have 11 px at any zoom, have room for eleven letters. */
const NAMED = 0.4;
const LEAST = 0.08;

/** Return the part of the canvas that nothing covers. */
function freeOf({ width, height, covered = TOOLS }: CanvasArea): Bounds {
  const { left, top, right, bottom } = covered;
  return {
    x: left + AIR,
    y: top + AIR,
    width: Math.max(1, width - left - right - 2 * AIR),
    height: Math.max(1, height - top - bottom - 2 * AIR),
  };
}

/** Return the box around all places and points; null if there are no places. */
export function boundsOf(
  places: Positions,
  sizes: Sizes,
  points: Iterable<Position> = [],
): Bounds | null {
  let box: [number, number, number, number] | null = null;
  for (const [key, [x, y]] of places) {
    const { width, height } = sizes.get(key) ?? CARD;
    box ??= [x, y, x + width, y + height];
    box = [
      Math.min(box[0], x),
      Math.min(box[1], y),
      Math.max(box[2], x + width),
      Math.max(box[3], y + height),
    ];
  }
  for (const [x, y] of points) {
    if (box === null) break;
    box = [Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y)];
  }
  return box && { x: box[0], y: box[1], width: box[2] - box[0], height: box[3] - box[1] };
}

function zoomFor(box: Bounds, free: Bounds): number {
  const across = free.width / Math.max(1, box.width);
  const down = free.height / Math.max(1, box.height);
  return Math.max(LEAST, Math.min(1, across, down));
}

/** Return the viewport that shows the whole box, however small it becomes. */
export function wholeViewport(box: Bounds, room: CanvasArea): Viewport {
  const free = freeOf(room);
  const zoom = zoomFor(box, free);
  return {
    x: free.x + free.width / 2 - (box.x + box.width / 2) * zoom,
    y: free.y + free.height / 2 - (box.y + box.height / 2) * zoom,
    zoom,
  };
}

/** Return the offset of one axis: centred if everything fits, else as near to `goal` as the edges allow. */
function offset(
  [from, size]: readonly [number, number],
  [start, length]: readonly [number, number],
  zoom: number,
  goal: number,
): number {
  if (size * zoom <= length) return start + length / 2 - (from + size / 2) * zoom;
  const [first, last] = [start - from * zoom, start + length - (from + size) * zoom];
  return Math.min(first, Math.max(last, start + length / 2 - goal * zoom));
}

/**
 * Return the viewport of a graph that has just opened: all of it if names are readable then, else its
 * start at the zoom `least` with `entry` (the middle of the entry) in view.
 */
export function firstViewport(
  box: Bounds,
  room: CanvasArea,
  entry: Position,
  least: number,
  direction: Direction,
): Viewport {
  const free = freeOf(room);
  if (zoomFor(box, free) >= Math.min(NAMED, least)) return wholeViewport(box, room);
  const right = direction === "right";
  const x = offset([box.x, box.width], [free.x, free.width], least, right ? box.x : entry[0]);
  const y = offset([box.y, box.height], [free.y, free.height], least, right ? entry[1] : box.y);
  return { x, y, zoom: least };
}

/** Return the nearest viewport of the same zoom that shows a box; null if the box is visible already. */
export function viewportShowing(box: Bounds, room: CanvasArea, now: Viewport): Viewport | null {
  const { left, top, right, bottom } = room.covered ?? TOOLS;
  const across = [left, room.width - right] as const;
  const down = [top, room.height - bottom] as const;
  const dx = shift(box.x * now.zoom + now.x, box.width * now.zoom, across);
  const dy = shift(box.y * now.zoom + now.y, box.height * now.zoom, down);
  return dx === 0 && dy === 0 ? null : { x: now.x + dx, y: now.y + dy, zoom: now.zoom };
}

/** Return by how much a stretch must move to lie within another; 0 if it does already. */
function shift(from: number, size: number, [start, end]: readonly [number, number]): number {
  if (from >= start && from + size <= end) return 0;
  const free = Math.max(0, end - start - size);
  const air = Math.min(AROUND, free / 2);
  return (from < start ? start + air : start + free - air) - from;
}

const AROUND = 44; // px kept around what is brought into view

/** Return whether a whole box can be visible at a zoom. */
export function fitsAt(box: Bounds, room: CanvasArea, zoom: number): boolean {
  const free = freeOf(room);
  return box.width * zoom <= free.width && box.height * zoom <= free.height;
}

/** Return whether two viewports differ by less than can be seen. */
export function isSameViewport(a: Viewport, b: Viewport): boolean {
  const near = (x: number, y: number) => Math.abs(x - y) < 2;
  return near(a.x, b.x) && near(a.y, b.y) && Math.abs(a.zoom - b.zoom) < 0.005;
}
