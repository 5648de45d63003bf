/** Chooses how much of each card is drawn at a zoom, and tells the style sheets without rendering a card. */

import { useStoreApi } from "@xyflow/react";
import { useLayoutEffect } from "react";
import type { Tone } from "../status/progress";
import "./zoom-detail.css";

/** `sign`: too far for names, the state alone is left. */
type Detail = "near" | "middle" | "far" | "sign";

/** From this zoom on; below the last one there is nothing less to show. */
const FROM: readonly (readonly [Detail, number])[] = [
  ["near", 0.9],
  ["middle", 0.5],
  ["far", 0.33],
];
/**
 * What was shown changes back only this much later, so that nothing flickers at a threshold. Not so
 * what is near: graphs open at just that zoom (READABLE), and Fit leads to it from further away.
 */
const PLAY: Readonly<Record<Detail, number>> = { near: 1, middle: 1.05, far: 1.05, sign: 1 };
/** Zooms are numbers of a machine: 0.9 may be a little less. */
const SLACK = 0.001;

const ORDER: readonly Detail[] = ["sign", "far", "middle", "near"];

export function detailAt(zoom: number, before: Detail | null): Detail {
  const [now = "sign"] = FROM.find(([, from]) => zoom >= from - SLACK) ?? [];
  if (before === null || ORDER.indexOf(now) <= ORDER.indexOf(before)) return now;
  const [late = "sign"] = FROM.find(([detail, from]) => zoom >= from * PLAY[detail] - SLACK) ?? [];
  return ORDER.indexOf(late) > ORDER.indexOf(before) ? late : before;
}

const STEPS = 40;

/** As much of the canvas as one pixel on screen, px; in steps, since each is a restyling of all cards. */
export function unitAt(zoom: number): number {
  return STEPS / Math.max(1, Math.floor(zoom * STEPS + SLACK));
}

/** The state of an action in one letter, for where there is no room for a word. */
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
