/** Puts off what can wait until the page has nothing else to do. */

const SOON = 500; // ms, in Safari, which does not say when that is

/**
 * Calls `work` then, or after `within` ms: a page that draws nothing may not be called idle for many seconds.
 * Returns what calls it off.
 */
export function whenIdle(work: () => void, within: number): () => void {
  if (typeof requestIdleCallback === "undefined") {
    const timer = setTimeout(work, SOON);
    return () => clearTimeout(timer);
  }
  const asked = requestIdleCallback(work, { timeout: within });
  return () => cancelIdleCallback(asked);
}
