/**
 * Schedules updates with animation frames: what comes from others is told with a frame, what comes together once.
 *
 * A message with an edit is followed by one that names its place in the log, and twenty people send
 * many of both. Drawing after each would only make frames late that nobody sees.
 */
import { tick } from "../../clock/server-clock";

/** Calls `tell` soon, once, however often it is asked until then. */
export type Schedule = (tell: () => void) => void;

export const immediately: Schedule = (tell) => tell();

export interface FrameScheduler {
  readonly soon: Schedule;
  /** Cancels all calls that still wait. */
  close(): void;
}

/** In a page without frames, such as a hidden one, listeners are called after this time, ms. */
const UNSEEN_MS = 100;

/** Returns a scheduler. A listener that was called is not called again for `gap` ms. */
export function frameScheduler(gap = 0): FrameScheduler {
  const waiting = new Set<() => void>();
  let frame: number | undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let told = Number.NEGATIVE_INFINITY;
  const rest = () => {
    if (frame !== undefined) globalThis.cancelAnimationFrame?.(frame);
    clearTimeout(timer);
    timer = undefined;
  };
  const tellAll = () => {
    rest();
    told = tick();
    const all = [...waiting];
    waiting.clear();
    for (const tell of all) tell();
  };
  const tellWithFrame = () => {
    frame = globalThis.requestAnimationFrame?.(tellAll);
    timer = setTimeout(tellAll, UNSEEN_MS);
  };
  return {
    soon(tell) {
      waiting.add(tell);
      if (timer !== undefined) return;
      const wait = told + gap - tick();
      if (wait <= 0) tellWithFrame();
      else timer = setTimeout(tellWithFrame, wait);
    },
    close() {
      rest();
      waiting.clear();
    },
  };
}
