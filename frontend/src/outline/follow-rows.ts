/** Keeps the action that runs in sight in the outline of a phone, until its person scrolls. */
import { type RefObject, useEffect, useRef } from "react";
import { tick } from "../clock/server-clock";
import type { Key } from "../graph/model";
import type { Progress } from "../status/progress";

const HANDS_REST = 4_000; // ms without a touch after which rows are followed again

/** Return the key of the action that began last and still runs; null without one. */
export function latestRunning(progress: ReadonlyMap<Key, Progress>): Key | null {
  let found: readonly [Key, number] | null = null;
  for (const [key, { tone, since }] of progress)
    if (tone === "run" && since !== null && since > (found?.[1] ?? Number.NEGATIVE_INFINITY))
      found = [key, since];
  return found?.[0] ?? null;
}

/** Scrolls to the row of the action that began last. `list` scrolls; rows have their key in `data-row`. */
export function useRunningRow(
  list: RefObject<HTMLElement | null>,
  progress: ReadonlyMap<Key, Progress>,
  on: boolean,
): void {
  const touched = useRef(Number.NEGATIVE_INFINITY);
  const key = on ? latestRunning(progress) : null;
  useEffect(() => {
    const { current } = list;
    if (!on || current === null) return;
    const over = new AbortController();
    const note = () => {
      touched.current = tick();
    };
    for (const kind of ["pointerdown", "touchmove", "wheel", "keydown"])
      current.addEventListener(kind, note, { passive: true, signal: over.signal });
    return () => over.abort();
  }, [list, on]);
  useEffect(() => {
    if (key === null || tick() - touched.current < HANDS_REST) return;
    list.current
      ?.querySelector(`[data-row="${CSS.escape(key)}"]`)
      ?.scrollIntoView({ block: "nearest" });
  }, [list, key]);
}
