/** Sub-graphs as the canvas and the menus know them; the folder `levels`, which is loaded late, fills these stores. */
import { type ComponentType, useSyncExternalStore } from "react";
import type { LibraryAction } from "../api/documents/library";
import type { Action, Key } from "../graph/model";
import type { ToldProblem } from "../graph/problems/told-problems";
import type { Progress } from "../status/progress";
import { Watched } from "../ui/watched";
import type { Size, Sizes } from "./geometry/arrange";

export interface InsideSignProps {
  readonly of: Key;
  readonly name: string;
}

/** An action on the way inside. */
export interface InnerStep {
  readonly key: Key;
  readonly name: string;
}

interface GraphsInside {
  /** The names of graphs by their id. */
  readonly names: ReadonlyMap<string, string>;
  /** The ids of other graphs by the name of the actions that stand for them. */
  readonly byName: ReadonlyMap<string, string>;
  /** Whether actions of others with this graph's name stand for it, and for no older one. */
  readonly isNamed: boolean;
  /** Opens the graph for which an action stands. One that is drawn inside of others is told by all their
   * keys, joined by "/"; where it stands for none, the graph in which it is is opened. */
  enter(path: string): void;
  /** Opens a graph inside by the actions that lead there, outermost first, with one thing of it chosen. */
  show(by: readonly InnerStep[], chosen: string | null): void;
  /** What is drawn in place, without going anywhere. */
  readonly expand: {
    toggle(path: string): void;
    /** One level more than is expanded now, everywhere. */
    expandMore(): void;
    collapseAll(): void;
    isAnyExpanded(): boolean;
  };
  /** Back to the action through which one came; null where one came through none. */
  readonly leave: (() => void) | null;
  /** What is drawn at such an action. */
  readonly Sign: ComponentType<InsideSignProps>;
}

/** One for the page: there is one canvas. Null while nothing is known of other graphs. */
export const graphsInside = new Watched<GraphsInside | null>(null);

/** The sign of an action that stands for a graph. */
export function InsideSpot({ of, name }: InsideSignProps) {
  const { subscribe, now } = graphsInside;
  const Sign = useSyncExternalStore(subscribe, () =>
    now()?.byName.has(name) ? now()?.Sign : undefined,
  );
  return Sign && <Sign of={of} name={name} />;
}

/** What a graph is called. */
export function NameOfGraph({ id }: { id: string }) {
  const { subscribe, now } = graphsInside;
  return useSyncExternalStore(subscribe, () => now()?.names.get(id)) ?? "…";
}

/** By id. An action of the library comes first: then no graph is meant by the name. */
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

/** One for the page: there is one canvas. */
export const toldOnCanvas = new Watched<readonly ToldProblem[]>([]);
