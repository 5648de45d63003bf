/** Opens the context menu at the place of a right click or of a long press. */
import { type PointerEvent, useEffect, useMemo, useRef } from "react";
import type { EditorContext } from "../../edit-actions/editor-context";
import type { Position } from "../../graph/model";
import { arrowAt, nodeAt } from "./hit-test";

const REST = 500; // ms
const STILL = 8; // px that a resting finger may move

/** Opens the menu for the element at a point, and selects the element unless it is part of the selection. */
function openMenuAt(context: EditorContext, screen: Position): void {
  const target = nodeAt(screen) ?? arrowAt(screen);
  if (target === null) context.select([]);
  else if (!context.selection.has(target)) context.select([target]);
  context.openOverlay({ kind: "menu", screen });
}

/** Return the event handlers that open the menu. */
export function useContextMenu(context: EditorContext) {
  const now = useRef(context);
  now.current = context;
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const start = useRef<Position>([0, 0]);
  const fingers = useRef(new Set<number>());
  useEffect(() => () => clearTimeout(timer.current), []);
  return useMemo(() => {
    const end = (event: PointerEvent) => {
      fingers.current.delete(event.pointerId);
      clearTimeout(timer.current);
    };
    return {
      onPointerDownCapture(event: PointerEvent) {
        start.current = [event.clientX, event.clientY];
        if (event.pointerType === "mouse") return;
        fingers.current.add(event.pointerId);
        clearTimeout(timer.current);
        const onText = (event.target as Element).closest("textarea, input, button") !== null;
        if (fingers.current.size > 1 || onText) return;
        timer.current = setTimeout(() => {
          swallowClick();
          openMenuAt(now.current, start.current);
        }, REST);
      },
      onPointerMoveCapture(event: PointerEvent) {
        const [x, y] = start.current;
        if (Math.hypot(event.clientX - x, event.clientY - y) > STILL) clearTimeout(timer.current);
      },
      onPointerUpCapture: end,
      onPointerCancelCapture: end,
      onContextMenu(event: React.MouseEvent) {
        event.preventDefault();
        // Touch opens the menu by its own timer, and dragging with the right button moves the view.
        const touch =
          "pointerType" in event.nativeEvent && event.nativeEvent.pointerType === "touch";
        const [x, y] = start.current;
        const dragged = Math.hypot(event.clientX - x, event.clientY - y) > STILL;
        if (!touch && !dragged) openMenuAt(now.current, [event.clientX, event.clientY]);
      },
    };
  }, []);
}

/** Suppresses the click that follows a long press, since it would close the menu. */
function swallowClick(): void {
  const kinds = ["mousedown", "mouseup", "click"] as const;
  const swallow = (event: Event) => {
    event.stopPropagation();
    event.preventDefault();
  };
  const lift = (event: Event) => {
    if (event.cancelable) event.preventDefault();
    setTimeout(() => {
      for (const kind of kinds) window.removeEventListener(kind, swallow, { capture: true });
    }, 40);
  };
  for (const kind of kinds) window.addEventListener(kind, swallow, { capture: true });
  window.addEventListener("touchend", lift, { capture: true, passive: false, once: true });
  window.addEventListener("touchcancel", lift, { capture: true, once: true });
}
