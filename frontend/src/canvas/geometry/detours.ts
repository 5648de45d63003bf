/** Detours: an arrow that would pass behind cards gets a lane beside them. Pure. */

export interface Rectangle {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

export interface LanePoint {
  readonly x: number;
  readonly y: number;
}

const GAP = 30; // px between a lane and the cards that it passes
const SAMPLES = 14;
/** Above this many cards nobody can follow single arrows anyway, and looking takes too long. */
export const MOST_CARDS = 160;

function contains(box: Rectangle, { x, y }: LanePoint): boolean {
  return x > box.x - 6 && x < box.x + box.width + 6 && y > box.y - 4 && y < box.y + box.height + 4;
}

/** The points of the curve from an outcome down to an input. */
function curve(from: LanePoint, to: LanePoint): LanePoint[] {
  const bend = Math.max(24, (to.y - from.y) * 0.5);
  return Array.from({ length: SAMPLES }, (_, i) => {
    const t = (i + 1) / (SAMPLES + 1);
    const u = 1 - t;
    const [a, b, c, d] = [u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t];
    return {
      x: (a + b) * from.x + (c + d) * to.x,
      y: a * from.y + b * (from.y + bend) + c * (to.y - bend) + d * to.y,
    };
  });
}

/**
 * The x of the lane for an arrow that leads back up: through the gap when the cards stand side by
 * side, else round the left of everything on the way.
 */
export function laneBack(from: Rectangle, to: Rectangle, others: readonly Rectangle[]): number {
  if (from.x + from.width < to.x) return (from.x + from.width + to.x) / 2;
  if (to.x + to.width < from.x) return (to.x + to.width + from.x) / 2;
  const between = others.filter(
    (box) =>
      box.y < from.y + from.height &&
      box.y + box.height > to.y &&
      box.x < Math.max(from.x + from.width, to.x + to.width) &&
      box.x + box.width > Math.min(from.x, to.x) - GAP,
  );
  return Math.min(from.x, to.x, ...between.map((box) => box.x)) - GAP - 12;
}

/** The x of the lane for an arrow from `from` down to `to`; null when its way is free. */
export function laneFor(
  from: LanePoint,
  to: LanePoint,
  others: readonly Rectangle[],
): number | null {
  if (to.y < from.y + 8) return null;
  const points = curve(from, to);
  const hit = others.filter((box) => points.some((point) => contains(box, point)));
  if (hit.length === 0) return null;
  const between = others.filter(
    (box) =>
      box.y + box.height > from.y &&
      box.y < to.y &&
      hit.some((other) => box.x < other.x + other.width + GAP && box.x + box.width > other.x - GAP),
  );
  const left = Math.min(...between.map((box) => box.x)) - GAP;
  const right = Math.max(...between.map((box) => box.x + box.width)) + GAP;
  const cost = (x: number) => Math.abs(x - from.x) + Math.abs(x - to.x);
  return cost(left) < cost(right) ? left : right;
}
