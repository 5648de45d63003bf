/** Moves the view at once, and leaves the way there to the browser, which needs no page for that. */
import type { ReactFlowInstance, Viewport } from "@xyflow/react";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import { GRID } from "../../edit-actions/editor-context";

const css = ({ x, y, zoom }: Viewport) => `translate(${x}px, ${y}px) scale(${zoom})`;

/** What is seen of an element now, in the middle of a glide, too. */
function shown(element: Element): Viewport {
  const { a, e, f } = new DOMMatrixReadOnly(getComputedStyle(element).transform);
  return { x: e, y: f, zoom: a };
}

/**
 * Shows `next`, at the zoom of now, by a glide of so many ms; at once for 0. Whoever takes hold of
 * the canvas meanwhile, by a press or a wheel, holds what is under the pointer.
 */
export function glideTo(
  flow: ReactFlowInstance<CanvasNode, Arrow>,
  room: HTMLElement,
  next: Viewport,
  ms: number,
): void {
  const sheet = room.querySelector(".react-flow__viewport");
  if (sheet === null || ms === 0) {
    void flow.setViewport(next);
    return;
  }
  const before = shown(sheet);
  void flow.setViewport(next);
  const timing = { duration: ms, easing: "ease-in-out" };
  const moves = [sheet.animate([{ transform: css(before) }, { transform: css(next) }], timing)];
  // The dots are alike: less than one step of them looks like all of the way.
  const dots = room.querySelector(".react-flow__background");
  const rest = (way: number) => way % (GRID * next.zoom);
  const from = `translate(${rest(before.x - next.x)}px, ${rest(before.y - next.y)}px)`;
  if (dots) moves.push(dots.animate([{ transform: from }, { transform: "none" }], timing));

  const over = new AbortController();
  const hold = () => {
    void flow.setViewport(shown(sheet));
    for (const move of moves) move.cancel();
  };
  const listening = { capture: true, passive: true, signal: over.signal };
  for (const kind of ["pointerdown", "wheel"] as const)
    room.addEventListener(kind, hold, listening);
  void moves[0]?.finished.catch(() => undefined).finally(() => over.abort());
}
