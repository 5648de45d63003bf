/** Chooses the direction in which a phone draws a graph without places. Pure. */
import type { Graph } from "../../graph/model";
import { arrange, estimatedSizes, isUnplaced } from "./arrange";
import { boundsOf } from "./viewport";

interface Room {
  readonly width: number;
  readonly height: number;
}

function zoomOf(graph: Graph, room: Room): number {
  const sizes = estimatedSizes(graph);
  const box = boundsOf(arrange(graph, sizes), sizes);
  return box === null ? 1 : Math.min(room.width / box.width, room.height / box.height);
}

/**
 * Return the graph as a tall screen draws it: top-down where it has no places and cards are larger then. The
 * document keeps its own direction.
 */
export function inPortrait(graph: Graph, room: Room): Graph {
  if (graph.direction === "down" || !isUnplaced(graph)) return graph;
  const turned: Graph = { ...graph, direction: "down" };
  return zoomOf(turned, room) > zoomOf(graph, room) ? turned : graph;
}
