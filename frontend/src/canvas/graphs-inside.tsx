/** Sub-graphs as the canvas and the menus know them; the folder `levels`, which is loaded late, fills these stores. */
import type { ComponentType } from "react";
import type { LibraryAction } from "../api/library";
import type { Action, Key } from "../graph/model";
import type { ProblemGroup } from "../graph/problems/problem-groups";
import type { Progress } from "../status/progress";
import { useWatched, Watched } from "../ui/watched";
import type { Size, Sizes } from "./geometry/arrange";

export interface InsideSignProps {
  readonly of: Key;
  readonly name: string;
}

/** One action on the way to an inner graph. */
export interface InnerStep {
  readonly key: Key;
  readonly name: string;
}

interface GraphsInside {
  /** Names of all graphs by id. */
  readonly names: ReadonlyMap<string, string>;
  /** Ids of the other graphs by the name of the actions that stand for them. */
  readonly byName: ReadonlyMap<string, string>;
  /** True if actions with this graph's name stand for it, and not for an older graph of the same name. */
  readonly isNamed: boolean;
  /**
   * Opens the graph for which an action stands. `path`: keys of the expanded actions down to it,
   * joined by "/". If the action stands for no graph, the graph that contains it opens.
   */
  enter(path: string): void;
  /**
   * Opens an inner graph by the actions that lead to it, outermost first, and selects one of its
   * elements.
   */
  show(by: readonly InnerStep[], chosen: string | null): void;
  /** Expands graphs on the cards of their actions, without leaving the graph on the canvas. */
  readonly expand: {
    toggle(path: string): void;
    /** Expands one more level everywhere. */
    expandMore(): void;
    collapseAll(): void;
    isAnyExpanded(): boolean;
  };
  /** Returns to the action through which the person came; null if the graph was opened directly. */
  readonly leave: (() => void) | null;
  /** The component with the buttons that open and expand a graph, drawn on the card of its action. */
  readonly Sign: ComponentType<InsideSignProps>;
}

/** The page has one canvas, hence one store. Null until the other graphs are known. */
export const graphsInside = new Watched<GraphsInside | null>(null);

/** Draws the buttons of an action that stands for a graph, once they are loaded. */
export function InsideSpot({ of, name }: InsideSignProps) {
  const Sign = useWatched(graphsInside, (inside) =>
    inside?.byName.has(name) ? inside.Sign : undefined,
  );
  return Sign && <Sign of={of} name={name} />;
}

/** Shows the name of a graph. */
export function NameOfGraph({ id }: { id: string }) {
  return useWatched(graphsInside, (inside) => inside?.names.get(id)) ?? "…";
}

/**
 * Return the ids of the other graphs with an action that stands for a graph. If the library has an
 * action of that name, it is meant instead of the graph.
 */
export function usedIn(
  actions: readonly LibraryAction[],
  graph: { readonly id: string; readonly name: string },
): readonly string[] {
  const found = actions.find(({ name, document }) => document === null && name === graph.name);
  return (found?.used_in ?? []).filter((each) => each !== graph.id);
}

export interface LevelFrameProps {
  readonly of: Key;
  readonly progress: Progress | null;
}

/** An action drawn on the card of another; its place is relative to the card's upper left corner. */
export interface PartOnCard extends Size {
  /** Keys of the actions that lead there, joined by "/". */
  readonly path: string;
  readonly x: number;
  readonly y: number;
  readonly action: Action;
  readonly progress: Progress | null;
  /** The graph that it stands for is itself expanded on it. */
  readonly expanded: boolean;
}

interface ExpandedGraphs {
  readonly sizes: Sizes;
  /** The component that draws the expanded graph. */
  readonly Frame: ComponentType<LevelFrameProps>;
  /** Returns the actions drawn on a card in their current states. */
  partsOf(key: Key): readonly PartOnCard[];
}

/** The page has one canvas, hence one store. Null while nothing is expanded. */
export const expandedGraphs = new Watched<ExpandedGraphs | null>(null);

/** Return the size of an expanded card and the component that draws its graph; null if it is not expanded. */
export function useExpandedCard(key: Key): { size: Size; Frame: ExpandedGraphs["Frame"] } | null {
  const size = useWatched(expandedGraphs, (expanded) => expanded?.sizes.get(key));
  const Frame = expandedGraphs.now()?.Frame;
  return size && Frame ? { size, Frame } : null;
}

/** Problems of the graph on the canvas, including those of its inner graphs. */
export const toldOnCanvas = new Watched<readonly ProblemGroup[]>([]);
