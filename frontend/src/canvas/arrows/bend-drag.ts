/** Dragging a handle of a line: the line follows at once, and is bent when it is let go. */
import { useReactFlow } from "@xyflow/react";
import { type PointerEvent, useContext, useRef, useState } from "react";
import { LineContext } from "./line-store";
import type { Point } from "./scene";

/** A waypoint, or the middle of a piece, where there can be one. */
export interface BendHandle {
  readonly id: string;
  readonly kind: "bend" | "middle";
  /** Its place among the waypoints. */
  readonly index: number;
  readonly at: Point;
}

const STILL = 3; // px on the screen that a press may move

/** The waypoints with this one at a place. */
export const withBend = (
  via: readonly Point[],
  { kind, index }: BendHandle,
  at: Point,
): Point[] => [...via.slice(0, index), at, ...via.slice(kind === "bend" ? index + 1 : index)];

export function useBendDrag(
  bundle: string,
  via: readonly Point[],
  done: (via: Point[], handle: BendHandle) => void,
) {
  const lines = useContext(LineContext);
  const { screenToFlowPosition } = useReactFlow();
  const [dragged, setDragged] = useState<BendHandle | null>(null);
  const press = useRef<Point | null>(null);
  const start = (event: PointerEvent<HTMLElement>) => {
    if (event.button !== 0) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    press.current = [event.clientX, event.clientY];
  };
  const move = ({ clientX: x, clientY: y }: PointerEvent, handle: BendHandle) => {
    if (!press.current) return;
    const [fromX, fromY] = press.current;
    if (dragged === null && Math.hypot(x - fromX, y - fromY) <= STILL) return;
    const to = screenToFlowPosition({ x, y }, { snapToGrid: false });
    const at = lines.snapped([to.x, to.y]);
    setDragged({ ...handle, at });
    lines.lead(bundle, withBend(via, handle, at));
  };
  const end = (keep: boolean) => {
    press.current = null;
    if (dragged === null) return;
    setDragged(null);
    if (keep) done(withBend(via, dragged, dragged.at), dragged);
    lines.settle(keep);
  };
  return { dragged, start, move, end };
}
