/** Where labels of arrows stand, so that they cover neither each other nor cards. Pure. */
import type { LanePoint, Rectangle } from "./detours";

/** A label that wants a place: the points on its way that it may have, the best first. */
export interface LabelRequest {
  readonly id: string;
  readonly width: number;
  readonly height: number;
  /** Which part of the label lies on the point. */
  readonly anchor: "left" | "middle" | "right";
  readonly points: readonly LanePoint[];
}

/** Points of a way, from its middle outwards. */
const TRIES = [0.5, 0.4, 0.6, 0.32, 0.68, 0.25, 0.75, 0.18, 0.82] as const;

/** Parts of a label, px at zoom 1, of the type that `outcome-arrow.module.css` sets. */
const LINE = 17;
const LETTER = 6;
const SIGN = 14;
const EDGE = 14;

export function sizeOf(lines: readonly { readonly text: string; readonly signs: number }[]) {
  const widths = lines.map(({ text, signs }) => text.length * LETTER + signs * SIGN);
  return { width: Math.max(EDGE, ...widths) + EDGE, height: Math.max(1, lines.length) * LINE + 2 };
}

/** The points from an outcome down to an input, on a curve that starts and ends straight. */
export function alongCurve(from: LanePoint, to: LanePoint): LanePoint[] {
  const bend = Math.max(24, (to.y - from.y) * 0.5);
  return TRIES.map((t) => {
    const u = 1 - t;
    const [a, b, c, d] = [u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t];
    return {
      x: (a + b) * from.x + (c + d) * to.x,
      y: a * from.y + b * (from.y + bend) + c * (to.y - bend) + d * to.y,
    };
  });
}

/** The points of the upright part of a lane. */
export function alongLane(x: number, from: number, to: number): LanePoint[] {
  return TRIES.map((t) => ({ x, y: from + (to - from) * t }));
}

/** A label on a lane hangs on the side that is away from the cards. */
export function anchorOf(lane: number, from: number, to: number): LabelRequest["anchor"] {
  if (lane < Math.min(from, to)) return "right";
  return lane > Math.max(from, to) ? "left" : "middle";
}

const OVERHANG = 10; // px that an anchored label reaches over its point

export function boxAt({ x, y }: LanePoint, { width, height, anchor }: LabelRequest): Rectangle {
  const left =
    anchor === "middle" ? x - width / 2 : anchor === "left" ? x - OVERHANG : x - width + OVERHANG;
  return { x: left, y: y - height / 2, width, height };
}

function shared(a: Rectangle, b: Rectangle): number {
  const across = Math.min(a.x + a.width, b.x + b.width) - Math.max(a.x, b.x);
  const down = Math.min(a.y + a.height, b.y + b.height) - Math.max(a.y, b.y);
  return across > 0 && down > 0 ? across * down : 0;
}

/** The place of each label, by id: of the points that it may have the one that covers least. */
export function placeLabels(
  wishes: readonly LabelRequest[],
  cards: readonly Rectangle[],
): Map<string, LanePoint> {
  const placed: Rectangle[] = [];
  const places = new Map<string, LanePoint>();
  for (const wish of wishes) {
    let best: { point: LanePoint; box: Rectangle; cost: number } | null = null;
    for (const [i, point] of wish.points.entries()) {
      const box = boxAt(point, wish);
      let cost = i * 12; // rather in the middle of its way
      for (const other of placed) cost += 2 * shared(box, other);
      for (const card of cards) cost += shared(box, card);
      if (best === null || cost < best.cost) best = { point, box, cost };
      if (cost === i * 12) break;
    }
    if (best === null) continue;
    placed.push(best.box);
    places.set(wish.id, best.point);
  }
  return places;
}
