/** A value outside of React, for `useSyncExternalStore`: whoever needs it draws at once, without what is around. */

export class Watched<T> {
  #now: T;
  #listeners = new Set<() => void>();

  constructor(now: T) {
    this.#now = now;
  }

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };
  now = (): T => this.#now;

  set(next: T): void {
    this.#now = next;
    for (const listener of [...this.#listeners]) listener();
  }
}
