/**
 * Highlights on cards: the actions of one robot, the two ends of a data flow, open comments, and
 * what no expected course visits.
 */
import { createContext, type ReactNode } from "react";
import type { Key, Precondition } from "../graph/model";
import { useWatched, Watched } from "../ui/watched";

/** The actions that give a value, and the actions that take it. */
interface TouchedActions {
  readonly producers: ReadonlySet<Key>;
  readonly consumers: ReadonlySet<Key>;
}

/** Outcomes of arrows that no expected course takes, by relation, and actions that it never visits. */
export interface UntakenPlaces {
  readonly outcomes: ReadonlyMap<string, readonly Precondition[]>;
  readonly actions: ReadonlySet<Key>;
}

interface CardHighlights {
  /**
   * The robot whose actions are highlighted; null: all actions. The empty name stands for actions
   * of any robot.
   */
  readonly robot: string | null;
  /** The number of open comment threads by action. */
  readonly openThreads: ReadonlyMap<Key, number>;
  /** Outcomes and actions that no expected course takes; null while coverage is not shown. */
  readonly untaken: UntakenPlaces | null;
  /** The actions that the focused parameter connects; null: no parameter is focused. */
  readonly touched: TouchedActions | null;
}

const ALL: CardHighlights = { robot: null, openThreads: new Map(), untaken: null, touched: null };

const store = new Watched<CardHighlights>(ALL);

/** The page has one canvas, hence one store; each card subscribes to its own part. */
export const cardHighlights = {
  subscribe: store.subscribe,
  now: store.now,
  set: (change: Partial<CardHighlights>): void => store.set({ ...store.now(), ...change }),
  reset: (): void => store.set(ALL),
};

/** Return the robot whose actions are highlighted; null: all actions. */
export function useHighlightedRobot(): string | null {
  return useWatched(cardHighlights, ({ robot }) => robot);
}

/** Return whether a robot's actions are dimmed, since another robot is highlighted. */
export function useIsDimmed(robot: string): boolean {
  return useWatched(cardHighlights, ({ robot: lit }) => lit !== null && lit !== robot);
}

/** Return whether an action gives or takes the value of the focused parameter. */
export function useDataRole(key: Key): "gives" | "takes" | undefined {
  return useWatched(cardHighlights, ({ touched }) => {
    if (touched?.producers.has(key)) return "gives";
    return touched?.consumers.has(key) ? "takes" : undefined;
  });
}

/** Return the number of open comment threads about an action. */
export function useOpenThreadCount(key: Key): number {
  return useWatched(cardHighlights, ({ openThreads }) => openThreads.get(key) ?? 0);
}

const NONE: readonly Precondition[] = [];

/** Return the outcomes of a relation that no expected course takes; empty while coverage is not shown. */
export function useUntakenOutcomes(relation: string): readonly Precondition[] {
  return useWatched(cardHighlights, ({ untaken }) => untaken?.outcomes.get(relation) ?? NONE);
}

/** Return whether no expected course visits an action; false while coverage is not shown. */
export function useIsUnvisited(key: Key): boolean {
  return useWatched(cardHighlights, ({ untaken }) => untaken?.actions.has(key) ?? false);
}

/** Replaces the state on cards where the canvas shows something else than one run. */
export const CardStateContext = createContext<((key: Key) => ReactNode) | null>(null);
