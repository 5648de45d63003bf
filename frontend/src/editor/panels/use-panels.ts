/** State of the panels beside the canvas; on a phone, of the visible pane. */
import { useCallback, useState } from "react";
import type { Panel } from "../../edit-actions/editor-context";
import { whenThere } from "../../ui/focus-field";
import { useKept } from "../../ui/hooks";

export type Pane = "canvas" | "outline" | "history" | "details" | "run";

export type EditorSidePanel = "library" | "outline" | "history";

/** Selector of the outline's row that Tab reaches. */
export const ROW = '[role="treegrid"] [data-row][tabindex="0"]';

/** Selector of the newest entry of the history. */
export const ENTRY_BUTTON = "[data-history] [data-entry]";

/** Keeps on this device whether the lists are folded to a rail, as they are at first. */
function useFoldedList() {
  const [folded, setFolded] = useKept("aa.list-folded", true);
  return { folded, setFolded };
}

/**
 * Return the pane of a phone, and what shows another one. The outline comes first, then what this device showed
 * last of outline and canvas; what an address points at (`linked`) is shown on the canvas.
 */
function usePane(linked: boolean) {
  const [kept, keep] = useKept<Pane>("aa.phone-pane", "outline");
  const [pane, setPane] = useState<Pane>(linked || kept === "canvas" ? "canvas" : "outline");
  const choosePane = useCallback(
    (next: Pane) => {
      setPane(next);
      if (next === "outline" || next === "canvas") keep(next);
    },
    [keep],
  );
  return { pane, setPane, choosePane };
}

/** Return which panels are open, and the functions that open and close them. `linked`: the address names a part. */
export function usePanels(linked: boolean) {
  const [left, setLeft] = useState(false);
  const [right, setRight] = useState(false);
  const { pane, setPane, choosePane } = usePane(linked);
  const [side, setSide] = useState<EditorSidePanel>("library");
  const { folded, setFolded } = useFoldedList();
  const fold = useCallback(
    (next: boolean) => {
      setFolded(next);
      setLeft(false);
    },
    [setFolded],
  );
  const onPanel = useCallback(
    (next: Panel) => {
      const listed = next === "outline" || next === "history" || next === "library";
      if (listed) setSide(next);
      setRight(!listed);
      setLeft(listed);
      if (next === "library") return;
      const isList = next === "outline" || next === "history";
      // Comments are asked for to be read: on a phone the canvas makes way.
      const leaves = (now: Pane) => now === "outline" || now === "history" || next === "comments";
      setPane((now) => (isList ? next : leaves(now) ? "details" : now));
      if (next === "outline") whenThere(ROW, (row) => row.focus());
      if (next === "history") whenThere(ENTRY_BUTTON, (entry) => entry.focus());
    },
    [setPane],
  );
  const panes = { pane, setPane, choosePane };
  return { left, setLeft, right, setRight, ...panes, side, setSide, folded, fold, onPanel };
}

export type Panels = ReturnType<typeof usePanels>;
