/**
 * The pace of a page: what comes from others is told once a frame.
 *
 * A message with an edit is followed by one that names its place in the log, and twenty people send
 * many of both. Drawing after each would only make frames late that nobody sees.
 */

/** Calls `tell` soon, once, however often it is asked until then. */
export type Soon = (tell: () => void) => void;

export const atOnce: Soon = (tell) => tell();

export interface Pace {
  readonly soon: Soon;
  /** What still waits is not told any more. */
  close(): void;
}

/** Where there are no frames, as in a page that nobody sees, it is told nevertheless, ms. */
const UNSEEN_MS = 100;

export function frames(): Pace {
  const waiting = new Set<() => void>();
  let frame: number | undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const rest = () => {
    if (frame !== undefined) globalThis.cancelAnimationFrame?.(frame);
    clearTimeout(timer);
    timer = undefined;
  };
  const tellAll = () => {
    rest();
    const all = [...waiting];
    waiting.clear();
    for (const tell of all) tell();
  };
  return {
    soon(tell) {
      waiting.add(tell);
      if (timer !== undefined) return;
      frame = globalThis.requestAnimationFrame?.(tellAll);
      timer = setTimeout(tellAll, UNSEEN_MS);
    },
    close() {
      rest();
      waiting.clear();
    },
  };
}
