/** How a graph is drawn with graphs expanded in it: what is larger than in the document has room. */
import type { ReactFlowInstance } from "@xyflow/react";
import { useMemo, useSyncExternalStore } from "react";
import type { Graph, Position } from "../../graph/model";
import { Watched } from "../../ui/watched";
import type { Arrow, CanvasNode } from "../elements";
import type { Positions, Sizes } from "../geometry/arrange";
import type { Folding } from "./folding";

/** Where something is that is elsewhere in another drawing. */
export type PlaceMap = (at: Position) => Position;

type Flow = ReactFlowInstance<CanvasNode, Arrow>;

/** A graph as the document has it. */
export interface StandingGraph {
  readonly graph: Graph;
  /** Where everything stands while nobody drags it. */
  readonly rest: Positions;
  readonly folding: Folding | null;
  readonly flow: Flow;
}

/** The same as it is drawn. The document knows nothing of that. */
export interface Spread {
  /** With its waypoints and frames as they are drawn. */
  readonly graph: Graph;
  readonly folding: Folding | null;
  /** Of the cards that are expanded. */
  readonly expanded: Sizes | undefined;
  /** Says of a place on the screen where it is in the document, and the other way round. */
  readonly flow: Flow;
  readonly toView: PlaceMap;
  readonly toDocument: PlaceMap;
  /** Where things are drawn that stand here. */
  placesOf(places: Positions): Positions;
  sizesOf(sizes: Sizes): Sizes;
}

/** One for the page. Null while nothing is expanded; it answers null where nothing is drawn otherwise. */
export const spreading = new Watched<((standing: StandingGraph) => Spread | null) | null>(null);

const same = <T>(as: T): T => as;
const AS_IT_STANDS = {
  ...{ expanded: undefined, toView: same, toDocument: same, placesOf: same, sizesOf: same },
};

export function useSpread({ graph, rest, folding, flow }: StandingGraph): Spread {
  const spread = useSyncExternalStore(spreading.subscribe, spreading.now);
  return useMemo(
    () => spread?.({ graph, rest, folding, flow }) ?? { ...AS_IT_STANDS, graph, folding, flow },
    [spread, graph, rest, folding, flow],
  );
}
