/** Through which actions one came into a graph, in its address: `?in=GRAPH~ACTION`, outermost first. Pure. */
import type { Key } from "../graph/model";

/** The action `action` of the graph `graph` was entered. */
export interface Level {
  readonly graph: string;
  readonly action: Key;
}

const MOST = 20; // levels; whoever goes on in a circle forgets where it began
const LEVEL = /^([\w-]{1,64})~([\w-]{1,64})$/;

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

/** A graph inside, entered from where one is by these actions, with one of its own or an arrow chosen. */
export function addressInside(
  search: string,
  by: readonly Level[],
  graph: string,
  action: Key | null = null,
): string {
  return address(graph, [...levelsOf(search), ...by], action);
}

/** The n-th graph around, with the action chosen through which one came; null: there is none. */
export function addressAround(search: string, n: number): string | null {
  const levels = levelsOf(search);
  const to = levels[n];
  return to === undefined ? null : address(to.graph, levels.slice(0, n), to.action);
}
