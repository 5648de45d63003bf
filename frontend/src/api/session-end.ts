/** Whether the session of this page has ended while the page is open. */

type Listener = () => void;

const listeners = new Set<Listener>();
let ended = false;

function put(next: boolean): void {
  if (ended === next) return;
  ended = next;
  for (const listener of [...listeners]) listener();
}

/** Usable without React: `subscribe` and `now` fit `useSyncExternalStore`. */
export const sessionEnd = {
  now: (): boolean => ended,
  subscribe: (listener: Listener): (() => void) => {
    listeners.add(listener);
    return () => listeners.delete(listener);
  },
  /** A server has answered that nobody is signed in. */
  notice: (): void => put(true),
  /** Somebody is signed in. */
  clear: (): void => put(false),
};
