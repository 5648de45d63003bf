/** Highlights on cards: whose robot's actions stand out, who gives and takes a value, open threads. */
import { createContext, type ReactNode, useSyncExternalStore } from "react";
import type { Key, Precondition } from "../graph/model";

/** The actions that give a value, and those that take it. */
interface TouchedActions {
  readonly producers: ReadonlySet<Key>;
  readonly consumers: ReadonlySet<Key>;
}

/** Outcomes of arrows that nothing takes, by relation, and actions that nothing comes to. */
export interface UntakenPlaces {
  readonly outcomes: ReadonlyMap<string, readonly Precondition[]>;
  readonly actions: ReadonlySet<Key>;
}

interface CardHighlights {
  /** The robot whose actions stand out; null: all. The empty name is that of any robot. */
  readonly robot: string | null;
  /** Open threads by action. */
  readonly openThreads: ReadonlyMap<Key, number>;
  /** What no expected course takes, while that is looked at. */
  readonly untaken: UntakenPlaces | null;
  /** Whom the parameter in focus ties together; null: none is in focus. */
  readonly touched: TouchedActions | null;
}

const ALL: CardHighlights = { robot: null, openThreads: new Map(), untaken: null, touched: null };

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

/** Whether an action gives the value in focus, or takes it. */
export function useDataRole(key: Key): "gives" | "takes" | undefined {
  return useSyncExternalStore(cardHighlights.subscribe, () => {
    const { touched } = cardHighlights.now();
    if (touched?.producers.has(key)) return "gives";
    return touched?.consumers.has(key) ? "takes" : undefined;
  });
}

/** How many open threads there are about an action. */
export function useOpenThreadCount(key: Key): number {
  return useSyncExternalStore(
    cardHighlights.subscribe,
    () => cardHighlights.now().openThreads.get(key) ?? 0,
  );
}

const NONE: readonly Precondition[] = [];

/** The outcomes of a relation that nothing takes, while that is looked at. */
export function useUntakenOutcomes(relation: string): readonly Precondition[] {
  return useSyncExternalStore(
    cardHighlights.subscribe,
    () => cardHighlights.now().untaken?.outcomes.get(relation) ?? NONE,
  );
}

/** Whether nothing comes to an action, while that is looked at. */
export function useIsUnvisited(key: Key): boolean {
  return useSyncExternalStore(
    cardHighlights.subscribe,
    () => cardHighlights.now().untaken?.actions.has(key) ?? false,
  );
}

/** What stands in place of the state where something else than one run is shown. */
export const CardStateContext = createContext<((key: Key) => ReactNode) | null>(null);
