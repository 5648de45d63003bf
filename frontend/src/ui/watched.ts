/** A value outside of React; a component that reads it renders again when it changes, without its parents. */
import { useSyncExternalStore } from "react";

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

/** Return a watched value, or the part that `select` takes of it; equal parts render nothing again. */
export function useWatched<T>(watched: Pick<Watched<T>, "subscribe" | "now">): T;
export function useWatched<T, Part>(
  watched: Pick<Watched<T>, "subscribe" | "now">,
  select: (now: T) => Part,
): Part;
export function useWatched<T>(
  { subscribe, now }: Pick<Watched<T>, "subscribe" | "now">,
  select: (now: T) => unknown = (value) => value,
): unknown {
  return useSyncExternalStore(subscribe, () => select(now()));
}
