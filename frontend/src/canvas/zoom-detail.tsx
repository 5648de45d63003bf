/** Chooses how much of each card is drawn at a zoom, and tells the style sheets without rendering a card. */

import { useStoreApi } from "@xyflow/react";
import { useLayoutEffect } from "react";
import type { Tone } from "../status/progress";
import "./zoom-detail.css";

/** The amount that is drawn of a card. `sign`: names would be too small, only the state is shown. */
type Detail = "near" | "middle" | "far" | "sign";

/** The least zoom of each detail; below the last one only signs are shown. */
const FROM: readonly (readonly [Detail, number])[] = [
  ["near", 0.9],
  ["middle", 0.5],
  ["far", 0.33],
];
/**
 * Factors by which the zoom must exceed a threshold before more is shown again, so that nothing
 * flickers at a threshold. `near` has none: graphs open at exactly that zoom (READABLE), and Fit
 * may lead to it.
 */
const PLAY: Readonly<Record<Detail, number>> = { near: 1, middle: 1.05, far: 1.05, sign: 1 };
/** Tolerance for floating-point zooms, such as 0.8999. */
const SLACK = 0.001;

const ORDER: readonly Detail[] = ["sign", "far", "middle", "near"];

/** Return how much is drawn at a zoom. `before`: the detail drawn so far; null at first. */
export function detailAt(zoom: number, before: Detail | null): Detail {
  const [now = "sign"] = FROM.find(([, from]) => zoom >= from - SLACK) ?? [];
  if (before === null || ORDER.indexOf(now) <= ORDER.indexOf(before)) return now;
  const [late = "sign"] = FROM.find(([detail, from]) => zoom >= from * PLAY[detail] - SLACK) ?? [];
  return ORDER.indexOf(late) > ORDER.indexOf(before) ? late : before;
}

const STEPS = 40;

/**
 * Return the length of one screen pixel on the canvas, px. It changes in steps, since each change
 * restyles all cards.
 */
export function unitAt(zoom: number): number {
  return STEPS / Math.max(1, Math.floor(zoom * STEPS + SLACK));
}

/** One character for the state of an action, where a word has no room. */
export const STATE_LETTER: Readonly<Record<Tone, string>> = {
  idle: "",
  run: "▶",
  true: "✓",
  false: "✗",
  error: "!",
  stopped: "■",
  done: "✓",
  unknown: "?",
};

/** Writes the detail and the size of a screen pixel to the canvas element whenever the zoom changes. */
export function ZoomDetail() {
  const store = useStoreApi();
  useLayoutEffect(() => {
    let [detail, unit]: [Detail | null, number] = [null, 0];
    const tell = () => {
      const {
        transform: [, , zoom],
        domNode,
      } = store.getState();
      if (domNode === null) return;
      const [nextDetail, nextUnit] = [detailAt(zoom, detail), unitAt(zoom)];
      if (nextDetail !== detail) domNode.dataset.detail = nextDetail;
      if (nextUnit !== unit) {
        domNode.style.setProperty("--unit", `${nextUnit}px`);
        domNode.style.setProperty("--out", String(nextUnit));
      }
      [detail, unit] = [nextDetail, nextUnit];
    };
    tell();
    return store.subscribe(tell);
  }, [store]);
  return null;
}
