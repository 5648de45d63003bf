/**
 * The levels through which a person came into a graph, kept in the address: `?in=GRAPH~ACTION`,
 * outermost first. Pure.
 */
import type { Key } from "../graph/model";

/** The graph `graph`, and its action `action` that was entered. */
export interface Level {
  readonly graph: string;
  readonly action: Key;
}

const MOST = 20; // levels; on a longer way, for example in a cycle, the outermost are dropped
const LEVEL = /^([\w-]{1,64})~([\w-]{1,64})$/;

/** Return the levels in the search part of an address; invalid ones are left out. */
export function levelsOf(search: string): Level[] {
  return new URLSearchParams(search).getAll("in").flatMap((text) => {
    const [, graph, action] = LEVEL.exec(text) ?? [];
    return graph !== undefined && action !== undefined ? [{ graph, action }] : [];
  });
}

function address(graph: string, levels: readonly Level[], action: Key | null): string {
  const query = new URLSearchParams();
  for (const level of levels.slice(-MOST)) query.append("in", `${level.graph}~${level.action}`);
  if (action !== null) query.append(action.includes(">") ? "arrow" : "action", action);
  const text = query.toString();
  return `/graphs/${encodeURIComponent(graph)}${text === "" ? "" : `?${text}`}`;
}

/**
 * Return the address of an inner graph that is entered by these levels from the current one, with
 * an action or arrow of it selected.
 */
export function addressInside(
  search: string,
  by: readonly Level[],
  graph: string,
  action: Key | null = null,
): string {
  return address(graph, [...levelsOf(search), ...by], action);
}

/**
 * Return the address of the n-th surrounding graph, with the action selected that was entered;
 * null: there is no such level.
 */
export function addressAround(search: string, n: number): string | null {
  const levels = levelsOf(search);
  const to = levels[n];
  return to === undefined ? null : address(to.graph, levels.slice(0, n), to.action);
}
