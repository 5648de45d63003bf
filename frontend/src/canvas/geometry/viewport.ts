/** Viewports of the canvas (offset and zoom) that keep text readable. Pure. */
import type { Positions, Sizes } from "./arrange";
import { CARD } from "./arrange";

export interface Bounds {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** The canvas' offset in px, and its zoom. */
export interface Viewport {
  readonly x: number;
  readonly y: number;
  readonly zoom: number;
}

interface FrameSize {
  readonly width: number;
  readonly height: number;
}

/** Kept free round what is shown, px on screen; the tools lie below. */
export const MARGIN = { top: 28, bottom: 72, side: 28 } as const;
/** Below this text on cards is hard to read. */
export const READABLE = { desktop: 0.75, phone: 0.6 } as const;
const LEAST = 0.08;

/** The box round everything that stands somewhere; null while nothing does. */
export function boundsOf(places: Positions, sizes: Sizes): Bounds | null {
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
  return box && { x: box[0], y: box[1], width: box[2] - box[0], height: box[3] - box[1] };
}

function zoomFor(box: Bounds, room: FrameSize): number {
  const across = (room.width - 2 * MARGIN.side) / Math.max(1, box.width);
  const down = (room.height - MARGIN.top - MARGIN.bottom) / Math.max(1, box.height);
  return Math.max(LEAST, Math.min(1, across, down));
}

/** All of it, however small that is. */
export function wholeViewport(box: Bounds, room: FrameSize): Viewport {
  const zoom = zoomFor(box, room);
  const free = room.height - MARGIN.top - MARGIN.bottom;
  return {
    x: room.width / 2 - (box.x + box.width / 2) * zoom,
    y: MARGIN.top + Math.max(0, (free - box.height * zoom) / 2) - box.y * zoom,
    zoom,
  };
}

/**
 * All of it where it can be read so, else its top at the smallest readable zoom. What is too wide
 * is centred on `top`, the entry, as far as its edges allow.
 */
export function readableViewport(
  box: Bounds,
  room: FrameSize,
  top: number,
  least: number,
): Viewport {
  if (zoomFor(box, room) >= least) return wholeViewport(box, room);
  const free = room.width - 2 * MARGIN.side;
  const [left, right] = [
    MARGIN.side - box.x * least,
    MARGIN.side + free - (box.x + box.width) * least,
  ];
  const fits = box.width * least <= free;
  const middle = room.width / 2 - (fits ? box.x + box.width / 2 : top) * least;
  return {
    x: fits ? middle : Math.min(left, Math.max(right, middle)),
    y: MARGIN.top - box.y * least,
    zoom: least,
  };
}

const AIR = { x: 40, y: 56 } as const; // px kept round what is brought into view

/** The nearest view, at the same zoom, that shows a box; null when it is in view already. */
export function viewportShowing(box: Bounds, room: FrameSize, now: Viewport): Viewport | null {
  const dx = shift(box.x * now.zoom + now.x, box.width * now.zoom, room.width, AIR.x);
  const low = room.height - MARGIN.bottom;
  const dy = shift(box.y * now.zoom + now.y, box.height * now.zoom, low, AIR.y);
  return dx === 0 && dy === 0 ? null : { x: now.x + dx, y: now.y + dy, zoom: now.zoom };
}

/** How far a stretch has to move to lie within 0 and `length`; with some air if it has to at all. */
function shift(from: number, size: number, length: number, air: number): number {
  if (from >= 0 && from + size <= length) return 0;
  const free = Math.max(0, length - size);
  const goal = from < 0 ? Math.min(air, free / 2) : free - Math.min(air, free / 2);
  return goal - from;
}

/** Whether a box can be shown whole at a zoom. */
export function fitsAt(box: Bounds, room: FrameSize, zoom: number): boolean {
  const high = room.height - MARGIN.top - MARGIN.bottom;
  return box.width * zoom <= room.width && box.height * zoom <= high;
}

/** The same view, but for what nobody can see. */
export function isSameViewport(a: Viewport, b: Viewport): boolean {
  const near = (x: number, y: number) => Math.abs(x - y) < 2;
  return near(a.x, b.x) && near(a.y, b.y) && Math.abs(a.zoom - b.zoom) < 0.005;
}
