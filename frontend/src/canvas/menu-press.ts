/** Opens a menu at the place of a right click, of a long press, or of what a key asks it for. */
import {
  type KeyboardEvent,
  type MouseEvent,
  type PointerEvent,
  useEffect,
  useMemo,
  useRef,
} from "react";
import type { Position } from "../graph/model";
import { keyOf } from "../ui/keys";

const REST = 500; // ms
const STILL = 8; // px that a resting finger may move

/** Return the event handlers that call `open` with the place on the screen. */
export function useMenuPress(open: (screen: Position) => void) {
  const now = useRef(open);
  now.current = open;
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
          now.current(start.current);
        }, REST);
      },
      onPointerMoveCapture(event: PointerEvent) {
        const [x, y] = start.current;
        if (Math.hypot(event.clientX - x, event.clientY - y) > STILL) clearTimeout(timer.current);
      },
      onPointerUpCapture: end,
      onPointerCancelCapture: end,
      onContextMenu(event: MouseEvent) {
        event.preventDefault();
        // Touch opens the menu by its own timer, and dragging with the right button moves the view.
        const touch =
          "pointerType" in event.nativeEvent && event.nativeEvent.pointerType === "touch";
        const [x, y] = start.current;
        const dragged = Math.hypot(event.clientX - x, event.clientY - y) > STILL;
        if (!touch && !dragged) now.current([event.clientX, event.clientY]);
      },
    };
  }, []);
}

/**
 * Return the card or arrow for which a key asks for its menu, with the place for that; null for another key or
 * without such a focus.
 */
export function menuKeyTarget(event: KeyboardEvent): { id: string; screen: Position } | null {
  const key = keyOf(event);
  if (key !== "ContextMenu" && !(key === "F10" && event.shiftKey)) return null;
  const target = (event.target as Element).closest<HTMLElement>(
    ".react-flow__node, .react-flow__edge",
  );
  const id = target?.dataset.id?.split("|")[0];
  if (target === null || id === undefined) return null;
  const { left, right, top, bottom } = target.getBoundingClientRect();
  return { id, screen: [(left + right) / 2, (top + bottom) / 2] };
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
  // A pen sends no touch events: without these nothing could be clicked any more, Stop included.
  window.addEventListener("pointerup", lift, { capture: true, once: true });
  window.addEventListener("pointercancel", lift, { capture: true, once: true });
}
