/** Tells the style sheets how far away the canvas is, so that no card is rendered for it. */
import { useStoreApi } from "@xyflow/react";
import { useLayoutEffect } from "react";
import { type Detail, detailAt, unitAt } from "./detail";
import "./detail.css";

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
