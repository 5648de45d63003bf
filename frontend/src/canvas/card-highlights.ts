/** Highlights on cards: whose robot's actions stand out, and how many open threads each has. */
import { useSyncExternalStore } from "react";
import type { Key } from "../graph/model";

interface CardHighlights {
  /** The robot whose actions stand out; null: all. The empty name is that of any robot. */
  readonly robot: string | null;
  /** Open threads by action. */
  readonly openThreads: ReadonlyMap<Key, number>;
}

const ALL: CardHighlights = { robot: null, openThreads: new Map() };

/** One for the page: there is one canvas. Cards listen for themselves, so that few draw again. */
class CardHighlightStore {
  #now: CardHighlights = ALL;
  #listeners = new Set<() => void>();

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };
  now = (): CardHighlights => this.#now;

  set(change: Partial<CardHighlights>): void {
    this.#now = { ...this.#now, ...change };
    for (const listener of [...this.#listeners]) listener();
  }

  reset = (): void => this.set(ALL);
}

export const cardHighlights = new CardHighlightStore();

/** The robot whose actions stand out. */
export function useHighlightedRobot(): string | null {
  return useSyncExternalStore(cardHighlights.subscribe, () => cardHighlights.now().robot);
}

/** Whether the actions of a robot are to step back. */
export function useIsDimmed(robot: string): boolean {
  return useSyncExternalStore(cardHighlights.subscribe, () => {
    const lit = cardHighlights.now().robot;
    return lit !== null && lit !== robot;
  });
}

/** How many open threads there are about an action. */
export function useOpenThreadCount(key: Key): number {
  return useSyncExternalStore(
    cardHighlights.subscribe,
    () => cardHighlights.now().openThreads.get(key) ?? 0,
  );
}
