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

/** Return the event handlers that call `open` with the place on the screen; it returns whether there was a menu. */
export function useMenuPress(open: (screen: Position) => boolean) {
  const now = useRef(open);
  now.current = open;
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const start = useRef<Position>([0, 0]);
  const fingers = useRef(new Set<number>());
  const lift = useRef<AbortController | null>(null);
  useEffect(
    () => () => {
      clearTimeout(timer.current);
      lift.current?.abort();
    },
    [],
  );
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
        lift.current?.abort();
        const { pointerId, currentTarget: canvas } = event;
        const pressed = event.target as Element;
        const onText = pressed.closest("textarea, input, button") !== null;
        if (fingers.current.size > 1 || onText) return;
        timer.current = setTimeout(() => {
          if (now.current(start.current)) lift.current = swallowClick(canvas, pressed, pointerId);
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

/**
 * Suppresses the click of one press on the canvas that has opened a menu, since it would close that. Nothing
 * else is suppressed: no press elsewhere, as on STOP, and none by mouse or key while the finger still rests.
 */
function swallowClick(canvas: Element, pressed: Element, pointerId: number): AbortController {
  const ending = new AbortController();
  const options = { capture: true, signal: ending.signal };
  const swallow = (event: Event) => {
    if (!canvas.contains(event.target as Node)) return;
    event.stopPropagation();
    event.preventDefault();
  };
  const lifted = (event: globalThis.PointerEvent) => {
    if (event.pointerId !== pointerId) return;
    for (const kind of ["mousedown", "mouseup", "click"])
      window.addEventListener(kind, swallow, options);
    setTimeout(() => ending.abort(), 40);
  };
  // A pen sends no touch events, and a finger sends these to what it pressed at first.
  window.addEventListener("pointerup", lifted, options);
  window.addEventListener("pointercancel", lifted, options);
  const touchEnded = (event: TouchEvent) => {
    if (event.target === pressed && event.cancelable) event.preventDefault();
  };
  window.addEventListener("touchend", touchEnded, { ...options, passive: false });
  return ending;
}
