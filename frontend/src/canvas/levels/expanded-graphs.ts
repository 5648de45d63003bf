/** Graphs that are expanded in place, as the canvas has to know them: larger cards, and what is on those. */
import { type ComponentType, useSyncExternalStore } from "react";
import type { Action, Key } from "../../graph/model";
import type { Progress } from "../../status/progress";
import { Watched } from "../../ui/watched";
import type { Size, Sizes } from "../geometry/arrange";

export interface LevelFrameProps {
  readonly of: Key;
  readonly progress: Progress | null;
}

/** Something that is drawn on the card of an action, from its upper left corner. */
export interface PartOnCard extends Size {
  /** Keys of the actions that lead there, joined by "/". */
  readonly path: string;
  readonly x: number;
  readonly y: number;
  readonly action: Action;
  readonly progress: Progress | null;
  /** The graph that it stands for is drawn on it in turn. */
  readonly expanded: boolean;
}

interface ExpandedGraphs {
  readonly sizes: Sizes;
  /** What is drawn on such a card. */
  readonly Frame: ComponentType<LevelFrameProps>;
  /** The actions on it, as they are now. */
  partsOf(key: Key): readonly PartOnCard[];
}

/** One for the page: there is one canvas. Null while nothing is expanded. */
export const expandedGraphs = new Watched<ExpandedGraphs | null>(null);

/** How large the card of an action is while it is expanded, and what is drawn on it. */
export function useExpandedCard(key: Key): { size: Size; Frame: ExpandedGraphs["Frame"] } | null {
  const { subscribe, now } = expandedGraphs;
  const size = useSyncExternalStore(subscribe, () => now()?.sizes.get(key));
  const Frame = now()?.Frame;
  return size && Frame ? { size, Frame } : null;
}
