/** What cards show besides themselves: whether their robot is in the light, and how much is said. */
import { useSyncExternalStore } from "react";
import type { Key } from "../graph/model";

export interface Light {
  /** The robot whose actions stand out; null: all. The empty name is that of any robot. */
  readonly robot: string | null;
  /** Open threads by action. */
  readonly talk: ReadonlyMap<Key, number>;
}

const ALL: Light = { robot: null, talk: new Map() };

/** One for the page: there is one canvas. Cards listen for themselves, so that few draw again. */
class Spotlight {
  #now: Light = ALL;
  #listeners = new Set<() => void>();

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };
  now = (): Light => this.#now;

  set(change: Partial<Light>): void {
    this.#now = { ...this.#now, ...change };
    for (const listener of [...this.#listeners]) listener();
  }

  reset = (): void => this.set(ALL);
}

export const spotlight = new Spotlight();

/** The robot whose actions stand out. */
export function useRobotInLight(): string | null {
  return useSyncExternalStore(spotlight.subscribe, () => spotlight.now().robot);
}

/** Whether the actions of a robot are to step back. */
export function useIsDim(robot: string): boolean {
  return useSyncExternalStore(spotlight.subscribe, () => {
    const lit = spotlight.now().robot;
    return lit !== null && lit !== robot;
  });
}

/** How many open threads there are about an action. */
export function useTalk(key: Key): number {
  return useSyncExternalStore(spotlight.subscribe, () => spotlight.now().talk.get(key) ?? 0);
}
