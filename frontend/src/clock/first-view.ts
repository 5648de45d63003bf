/** The first view of an editor: what it does not need waits until its cards are on screen. */
import { useSyncExternalStore } from "react";

/** Longest wait for the first view, ms: the graph may never come. */
const LONGEST = 10_000;

let isThere = true;
const listeners = new Set<() => void>();

/** Starts the wait for the first view: what it does not need waits with it, for some seconds at most. */
export function expectFirstView(): void {
  isThere = false;
  setTimeout(firstViewIsThere, LONGEST);
}

/** Ends the wait: the first view is on screen. */
export function firstViewIsThere(): void {
  if (isThere) return;
  isThere = true;
  for (const listener of [...listeners]) {
    try {
      listener();
    } catch (error) {
      reportError(error); // the others hear of it all the same
    }
  }
}

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** Return true if nothing has to wait for a first view. */
export function useFirstView(): boolean {
  return useSyncExternalStore(subscribe, () => isThere);
}

/** Calls `work` once nothing has to wait for a first view, at once if that is so. Returns what calls it off. */
export function onFirstView(work: () => void): () => void {
  if (isThere) {
    work();
    return () => {};
  }
  const end = subscribe(() => {
    end();
    work();
  });
  return end;
}

/** Resolves when nothing has to wait for a first view; rejects when `signal` is aborted before. */
export function afterFirstView(signal: AbortSignal | undefined): Promise<void> {
  return new Promise((resolve, reject) => {
    const end = onFirstView(resolve);
    signal?.addEventListener("abort", () => {
      end();
      reject(signal.reason);
    });
  });
}
