/** Which actions stand for graphs of the server, and how one goes into those and out again. */
import { type ComponentType, useSyncExternalStore } from "react";
import type { Key } from "../../graph/model";
import { Watched } from "../../ui/watched";

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
