/** Places where a run under way can have breakpoints. Apart from those of graphs, which the editor needs first. Pure. */
import { type RunBreakpoint, whyNoBreakpoint } from "./breakpoints";
import { relationId } from "./document-keys";
import { EXIT, fullName, type Graph, type Key } from "./model";

/** A place of a graph where a run can wait, by full names: an action, or the arrow from it to another. */
export interface Place {
  readonly action: string;
  /** "" for the action itself. */
  readonly to: string;
}

/** Return the place of an action or arrow; null for one at which no run can wait. `id`: its key or id. */
export function placeIn(graph: Graph, id: string): Place | null {
  const named = (key: Key) => {
    const action = graph.actions.find((each) => each.key === key && !each.missing);
    return action === undefined ? null : fullName(action);
  };
  const own = named(id);
  if (own !== null) return { action: own, to: "" };
  const arrow = graph.relations.find((each) => relationId(each) === id);
  if (arrow === undefined || whyNoBreakpoint(arrow) !== null) return null;
  const [action, to] = [named(arrow.parent), arrow.child === EXIT ? EXIT : named(arrow.child)];
  return action === null || to === null ? null : { action, to };
}

/** Return the breakpoints of a run after a person has set a plain one at a place, or removed those there. */
export function toggledAt(
  breakpoints: readonly RunBreakpoint[],
  { action, to }: Place,
): RunBreakpoint[] {
  const others = breakpoints.filter((each) => each.action !== action || (each.to ?? "") !== to);
  if (others.length < breakpoints.length) return others;
  return [...breakpoints, { action, ...(to !== "" && { to }) }];
}
