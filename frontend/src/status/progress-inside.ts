/**
 * Progress of a graph that runs inside of another: a run reports its actions by the names of all
 * levels. Pure.
 */

import { useRef } from "react";
import type { Run } from "../api/runs";
import { fullName, type Graph } from "../graph/model";
import { placesOf } from "./level-places";
import {
  type Progress,
  progressAt,
  progressByAid,
  progressOfAction,
  type Unsure,
} from "./progress";

/** The way from the outermost graph to one inside: by the names of the graphs below it, as far as nobody knows
 * which of several actions of a name was entered, and then by the very actions that one is inside of. */
type WayInside =
  | { readonly names: readonly string[]; readonly levels?: readonly string[] }
  | { readonly levels: readonly string[] };

/** A graph in a run of the outermost one around it. */
export type GraphInRun = WayInside & { readonly graph: Pick<Graph, "actions"> };

/** The run whose states are on the canvas. */
export interface RunOnCanvas {
  readonly run: Run;
  readonly unsure: Unsure;
  /** The moment at which its replay stands, ms. */
  readonly at: number | null;
  /** The names of the graphs below the run's, down to the one on the canvas. */
  readonly names: readonly string[];
}

const nameOf = (action: string): string => action.slice(0, Math.max(0, action.lastIndexOf("_")));

function isThere(told: readonly string[], way: WayInside): boolean {
  const { names = [], levels = [] } = "names" in way ? way : { levels: way.levels };
  return (
    told.length === names.length + levels.length &&
    names.every((name, i) => name === nameOf(told[i] ?? "")) &&
    levels.every((action, i) => action === told[names.length + i])
  );
}

/** Progress by the keys that the actions have here; those that the run knows under no such name have none. */
export function progressInside(
  run: Run,
  unsure: Unsure,
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

/** Return whether a run reports any action of the level. */
export function isInRun(run: Run, names: readonly string[]): boolean {
  return [...placesOf(run).values()].some(({ levels }) => isThere(levels, { names }));
}

/** Progress of the actions of a graph that is drawn inside of the one on the canvas: the actions `levels` lead
 * from there to it, by their full names. */
export function progressBelow(
  { run, unsure, at, names }: RunOnCanvas,
  graph: Pick<Graph, "actions">,
  levels: readonly string[],
): ReadonlyMap<string, Progress> {
  return progressAt(progressInside(run, unsure, { graph, names, levels }), at);
}

export type ProgressByAid = ReadonlyMap<string, Progress>;

function keptProgress(before: ProgressByAid, now: ProgressByAid): ProgressByAid {
  if (before.size !== now.size) return now;
  for (const [key, progress] of now) if (before.get(key) !== progress) return now;
  return before;
}

/** `at`: the moment at which a replay stands, ms. `inside`: what is shown is a graph inside of the run's. */
export function useProgress(
  run: Run | null,
  unsure: Unsure,
  at: number | null = null,
  inside: GraphInRun | null = null,
): ProgressByAid {
  const last = useRef<ProgressByAid>(new Map());
  const found =
    run === null || inside === null
      ? progressByAid(run, unsure)
      : progressInside(run, unsure, inside);
  const now = progressAt(found, at);
  last.current = keptProgress(last.current, now);
  return last.current;
}
