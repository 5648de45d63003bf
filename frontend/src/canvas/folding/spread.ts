/** Spreads the drawing of a graph so that expanded cards have room, without changing the document. */
import type { ReactFlowInstance } from "@xyflow/react";
import { useMemo } from "react";
import type { Graph, Position } from "../../graph/model";
import { useWatched, Watched } from "../../ui/watched";
import type { Arrow, CanvasNode } from "../elements";
import type { Positions, Sizes } from "../geometry/arrange";
import type { Folding } from "./folding";

/** Maps a place in the document to its place in the drawing, or back. */
export type PlaceMap = (at: Position) => Position;

type Flow = ReactFlowInstance<CanvasNode, Arrow>;

/** A graph with the places of the document. */
export interface StandingGraph {
  readonly graph: Graph;
  /** Places as they are while nothing is dragged. */
  readonly rest: Positions;
  readonly folding: Folding | null;
  readonly flow: Flow;
}

/** A graph as it is drawn, with room for expanded cards. */
export interface Spread {
  /** The graph with its waypoints and frames as they are drawn. */
  readonly graph: Graph;
  readonly folding: Folding | null;
  /** Sizes of the expanded cards. */
  readonly expanded: Sizes | undefined;
  /** A React Flow instance that converts between places on screen and places in the document. */
  readonly flow: Flow;
  readonly toView: PlaceMap;
  readonly toDocument: PlaceMap;
  /** Returns the drawn places of elements with these places in the document. */
  placesOf(places: Positions): Positions;
  sizesOf(sizes: Sizes): Sizes;
}

/**
 * The page has one canvas, hence one store. Null while nothing is expanded; the function returns
 * null if nothing is drawn differently.
 */
export const spreading = new Watched<((standing: StandingGraph) => Spread | null) | null>(null);

const same = <T>(as: T): T => as;
const AS_IT_STANDS = {
  ...{ expanded: undefined, toView: same, toDocument: same, placesOf: same, sizesOf: same },
};

/** Return the graph as it is drawn; without expanded cards that is the graph itself. */
export function useSpread({ graph, rest, folding, flow }: StandingGraph): Spread {
  const spread = useWatched(spreading);
  return useMemo(
    () => spread?.({ graph, rest, folding, flow }) ?? { ...AS_IT_STANDS, graph, folding, flow },
    [spread, graph, rest, folding, flow],
  );
}
