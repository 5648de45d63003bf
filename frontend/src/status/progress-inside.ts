/** What is said of a graph that runs inside of another: its actions are told by the names of all levels. Pure. */
import type { Run } from "../api/runs";
import { fullName, type Graph } from "../graph/model";
import { placesOf } from "./level-places";
import { type Progress, progressOfAction } from "./progress";

/** The way from the outermost graph to one inside: by the names of the graphs below it, down to this one, or
 * by the very actions that one is inside of. */
type WayInside = { readonly names: readonly string[] } | { readonly levels: readonly string[] };

/** A graph in a run of the outermost one around it. */
export type GraphInRun = WayInside & { readonly graph: Pick<Graph, "actions"> };

const nameOf = (action: string): string => action.slice(0, Math.max(0, action.lastIndexOf("_")));

function isThere(levels: readonly string[], way: WayInside): boolean {
  const wanted = "names" in way ? way.names : way.levels;
  const told = "names" in way ? levels.map(nameOf) : levels;
  return told.length === wanted.length && told.every((each, i) => each === wanted[i]);
}

/** Progress by the keys that the actions have here; those that the run knows under no such name have none. */
export function progressInside(
  run: Run,
  unsure: boolean,
  inside: GraphInRun,
): Map<string, Progress> {
  const keys = new Map(inside.graph.actions.map((action) => [fullName(action), action.key]));
  const found = new Map<string, Progress>();
  const places = placesOf(run);
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    const place = places.get(name);
    if (place === undefined || !isThere(place.levels, inside)) continue;
    const key = keys.get(place.name);
    if (key !== undefined) found.set(key, progressOfAction(name, action, run, unsure));
  }
  return found;
}

/** Whether a run has anything of it. */
export function isInRun(run: Run, names: readonly string[]): boolean {
  return [...placesOf(run).values()].some(({ levels }) => isThere(levels, { names }));
}
