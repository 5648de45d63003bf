/** Which panels beside the canvas are open; on a phone, which pane is shown. */
import { useCallback, useState } from "react";
import type { Panel } from "../edit-actions/editor-context";

export type Pane = "canvas" | "outline" | "details" | "run";

export type EditorSidePanel = "library" | "outline";

function focusOutline(): void {
  document.querySelector<HTMLElement>('[role="treegrid"] [data-row][tabindex="0"]')?.focus();
}

export function usePanels() {
  const [left, setLeft] = useState(false);
  const [right, setRight] = useState(false);
  const [pane, setPane] = useState<Pane>("canvas");
  const [side, setSide] = useState<EditorSidePanel>("library");
  const onPanel = useCallback((next: Panel) => {
    const outline = next === "outline";
    if (outline) setSide("outline");
    setRight(!outline);
    setLeft(outline);
    setPane((now) => (outline ? "outline" : now === "outline" ? "details" : now));
    if (outline) requestAnimationFrame(focusOutline);
  }, []);
  return { left, setLeft, right, setRight, pane, setPane, side, setSide, onPanel };
}

export type Panels = ReturnType<typeof usePanels>;
