/** Drags actions from the library to the canvas by pointer events, so that it works for fingers too. */
import { type PointerEvent as ReactPointerEvent, useEffect } from "react";
import type { NewAction } from "../graph/edit";
import { keyOf } from "../ui/keys";
import { useWatched, Watched } from "../ui/watched";
import style from "./action-drag.module.css";

interface DraggedAction {
  readonly payload: NewAction;
  readonly label: string;
  readonly x: number;
  readonly y: number;
}

type DropHandler = (dragged: DraggedAction) => void;

const THRESHOLD = 6; // px until a press becomes a drag

class ActionDrag {
  readonly #dragged = new Watched<DraggedAction | null>(null);
  #taker: DropHandler | null = null;

  readonly subscribe = this.#dragged.subscribe;
  readonly now = this.#dragged.now;

  /** Subscribe a handler of drops. Return the function that unsubscribes it. */
  onDrop(taker: DropHandler): () => void {
    this.#taker = taker;
    return () => {
      if (this.#taker === taker) this.#taker = null;
    };
  }

  /** To be called by `onPointerDown`: becomes a drag when the pointer moves, else stays a click. */
  press(event: ReactPointerEvent, load: NewAction, label: string): void {
    if (event.button !== 0) return;
    const [x0, y0, id] = [event.clientX, event.clientY, event.pointerId];
    const onMove = (move: PointerEvent) => {
      if (move.pointerId !== id) return;
      const far = Math.hypot(move.clientX - x0, move.clientY - y0) > THRESHOLD;
      if (this.now() === null && !far) return;
      move.preventDefault();
      this.#dragged.set({ payload: load, label, x: move.clientX, y: move.clientY });
    };
    const end = (drop: boolean) => (up: PointerEvent | KeyboardEvent) => {
      if ("pointerId" in up && up.pointerId !== id) return;
      if (up instanceof KeyboardEvent && keyOf(up) !== "Escape") return;
      window.removeEventListener("pointermove", onMove);
      window.removeEventListener("pointerup", onUp);
      window.removeEventListener("pointercancel", onCancel);
      window.removeEventListener("keydown", onCancel);
      const draggedItem = this.now();
      this.#dragged.set(null);
      if (drop && draggedItem) {
        swallowClick();
        this.#taker?.(draggedItem);
      }
    };
    const onUp = end(true);
    const onCancel = end(false);
    window.addEventListener("pointermove", onMove, { passive: false });
    window.addEventListener("pointerup", onUp);
    window.addEventListener("pointercancel", onCancel);
    window.addEventListener("keydown", onCancel);
  }
}

/** The click that a browser makes of the end of a drag is none. */
function swallowClick(): void {
  const swallow = (event: MouseEvent) => event.stopPropagation();
  window.addEventListener("click", swallow, { capture: true, once: true });
  setTimeout(() => window.removeEventListener("click", swallow, { capture: true }), 0);
}

export const actionDrag = new ActionDrag();

/** Preview of the dragged action, under the pointer. */
export function DragPreview() {
  const draggedItem = useWatched(actionDrag);
  const active = draggedItem !== null;
  useEffect(() => {
    document.body.classList.toggle(style.carrying ?? "", active);
    return () => document.body.classList.remove(style.carrying ?? "");
  }, [active]);
  if (draggedItem === null) return null;
  return (
    <div
      className={style.ghost}
      style={{ transform: `translate(${draggedItem.x - 104}px, ${draggedItem.y - 24}px)` }}
      aria-hidden
    >
      {draggedItem.label}
    </div>
  );
}
