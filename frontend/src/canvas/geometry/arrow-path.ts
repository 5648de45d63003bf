/** The paths of arrows: down, down a lane beside cards, or back up on one. Pure. */
import { getBezierPath, getSmoothStepPath, Position } from "@xyflow/react";
import { anchorOf } from "./label-places";

export interface ArrowPath {
  readonly path: string;
  readonly x: number;
  readonly y: number;
  readonly anchor: "left" | "middle" | "right";
}

export interface ArrowEnds {
  readonly sourceX: number;
  readonly sourceY: number;
  readonly targetX: number;
  readonly targetY: number;
  /** On which side of its card the arrow leaves; below, where nothing is said. */
  readonly sourcePosition?: Position;
}

/** Back up on a lane beside the cards, so that loops can be told from the way down. */
function backwards(sx: number, sy: number, tx: number, ty: number, side: number): ArrowPath {
  const [low, high] = [sy + 30, ty - 30];
  const out = Math.sign(side - sx) || 1;
  const back = Math.sign(tx - side) || -1;
  const r = Math.max(0, Math.min(16, Math.abs(side - sx) / 2, Math.abs(tx - side) / 2));
  const path =
    `M${sx} ${sy}V${low - r}Q${sx} ${low} ${sx + out * r} ${low}H${side - out * r}` +
    `Q${side} ${low} ${side} ${low - r}V${high + r}Q${side} ${high} ${side + back * r} ${high}` +
    `H${tx - back * r}Q${tx} ${high} ${tx} ${high + r}V${ty}`;
  return { path, x: side, y: (low + high) / 2, anchor: anchorOf(side, sx, tx) };
}

/** Down a lane beside the cards that stand in the way. */
function round(sx: number, sy: number, tx: number, ty: number, lane: number): ArrowPath {
  const out = Math.sign(lane - sx) || 1;
  const back = Math.sign(tx - lane) || -1;
  const [high, low] = [sy + 26, ty - 26];
  const r = Math.max(0, Math.min(18, Math.abs(lane - sx) / 2, Math.abs(tx - lane) / 2));
  const v = Math.min(r, Math.max(0, (low - high) / 2));
  const path =
    `M${sx} ${sy}V${high - v}Q${sx} ${high} ${sx + out * r} ${high}H${lane - out * r}` +
    `Q${lane} ${high} ${lane} ${high + v}V${low - v}Q${lane} ${low} ${lane + back * r} ${low}` +
    `H${tx - back * r}Q${tx} ${low} ${tx} ${low + v}V${ty}`;
  return { path, x: lane, y: (high + low) / 2, anchor: anchorOf(lane, sx, tx) };
}

/** From the right of a card to the left of another. */
function sideways({ sourceX, sourceY, targetX, targetY }: ArrowEnds): ArrowPath {
  const [path, x, y] = getSmoothStepPath({
    sourceX,
    sourceY,
    targetX: targetX - 2,
    targetY,
    sourcePosition: Position.Right,
    targetPosition: Position.Left,
    borderRadius: 10,
  });
  return { path, x, y, anchor: "middle" };
}

/** The way of an arrow; `lane` is the x of its lane, null where the way down is free. */
export function arrowPathOf(ends: ArrowEnds, lane: number | null): ArrowPath {
  const { sourceX, sourceY, targetX, targetY } = ends;
  if (ends.sourcePosition === Position.Right) return sideways(ends);
  const from = sourceY + 1;
  const to = targetY - 2;
  if (to < from + 8) {
    return backwards(sourceX, from, targetX, to, lane ?? Math.min(sourceX, targetX) - 150);
  }
  if (lane !== null && to > from + 60) return round(sourceX, from, targetX, to, lane);
  const [path, x, y] = getBezierPath({
    sourceX,
    sourceY: from,
    targetX,
    targetY: to,
    sourcePosition: Position.Bottom,
    targetPosition: Position.Top,
    curvature: 0.3,
  });
  return { path, x, y, anchor: "middle" };
}
