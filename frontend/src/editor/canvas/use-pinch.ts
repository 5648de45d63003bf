/** Moves and zooms the view with two fingers while the tool Select is active. */
import { useReactFlow, useStoreApi } from "@xyflow/react";
import { type PointerEvent, useMemo, useRef } from "react";
import type { EditorContext } from "../../edit-actions/editor-context";
import type { Position } from "../../graph/model";

export const ZOOM = { least: 0.08, most: 2.2 } as const;

interface Pair {
  /** The point between the fingers, on screen. */
  readonly middle: Position;
  /** The distance between the fingers, px. */
  readonly apart: number;
}

interface PinchedView {
  readonly x: number;
  readonly y: number;
  readonly zoom: number;
}

/**
 * Return the viewport that keeps the same part of the canvas under both fingers. `corner`: the
 * upper left corner of the canvas on screen.
 */
export function pinched(view: PinchedView, from: Pair, to: Pair, corner: Position): PinchedView {
  const wanted = (view.zoom * to.apart) / Math.max(1, from.apart);
  const zoom = Math.min(ZOOM.most, Math.max(ZOOM.least, wanted));
  const under = (i: 0 | 1, at: number) => (from.middle[i] - corner[i] - at) / view.zoom;
  return {
    x: to.middle[0] - corner[0] - under(0, view.x) * zoom,
    y: to.middle[1] - corner[1] - under(1, view.y) * zoom,
    zoom,
  };
}

function pairOf(fingers: ReadonlyMap<number, Position>): Pair {
  const [[x0, y0], [x1, y1]] = [...fingers.values()] as [Position, Position];
  return { middle: [(x0 + x1) / 2, (y0 + y1) / 2], apart: Math.hypot(x1 - x0, y1 - y0) };
}

/** Return the event handlers of the pinch. `onPanned`: called when it starts. */
export function usePinch(context: EditorContext, onPanned: () => void) {
  const flow = useReactFlow();
  const store = useStoreApi();
  const now = useRef({ context, onPanned });
  now.current = { context, onPanned };
  const fingers = useRef(new Map<number, Position>());
  const chosen = useRef<ReadonlySet<string>>(new Set());
  const begun = useRef<{ pair: Pair; view: PinchedView; corner: Position } | null>(null);
  return useMemo(() => {
    const at = (event: PointerEvent): Position => [event.clientX, event.clientY];
    return {
      down(event: PointerEvent) {
        if (event.pointerType !== "touch" || now.current.context.tool !== "select") return;
        if (event.isPrimary) {
          fingers.current.clear();
          chosen.current = now.current.context.selection;
        }
        fingers.current.set(event.pointerId, at(event));
        const box = store.getState().domNode?.getBoundingClientRect();
        if (fingers.current.size !== 2 || box === undefined) return;
        // The marquee and selection that the first finger started are undone.
        store.setState({ userSelectionRect: null, userSelectionActive: false });
        now.current.context.select(chosen.current);
        const pair = pairOf(fingers.current);
        begun.current = { pair, view: flow.getViewport(), corner: [box.left, box.top] };
        now.current.onPanned();
      },
      move(event: PointerEvent) {
        if (begun.current === null || !fingers.current.has(event.pointerId)) return;
        fingers.current.set(event.pointerId, at(event));
        const { pair, view, corner } = begun.current;
        void flow.setViewport(pinched(view, pair, pairOf(fingers.current), corner));
      },
      end(event: PointerEvent) {
        fingers.current.delete(event.pointerId);
        if (fingers.current.size < 2) begun.current = null;
      },
    };
  }, [flow, store]);
}
