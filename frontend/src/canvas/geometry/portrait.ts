/** Turns a graph top-down for a phone: by itself without places, else where a person asks for it. Pure. */
import type { Action, Graph, Relation } from "../../graph/model";
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

const loose = new WeakMap<Action, Action>();
const straight = new WeakMap<Relation, Relation>();

/** Return `whole` changed by `change`, the same object for the same one. */
function kept<T extends object>(known: WeakMap<T, T>, whole: T, change: Partial<T>): T {
  const found = known.get(whole) ?? { ...whole, ...change };
  known.set(whole, found);
  return found;
}

/**
 * Return a placed graph without its places, bends and notes, to be laid out top-down. Only to be looked at: what is
 * drawn so must not be written.
 */
export function topDown(graph: Graph): Graph {
  return {
    ...graph,
    direction: "down",
    entryPosition: null,
    exitPosition: null,
    actions: graph.actions.map((action) => kept(loose, action, { position: null })),
    relations: graph.relations.map((relation) => kept(straight, relation, { waypoints: [] })),
    notes: [],
  };
}
