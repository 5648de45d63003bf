/**
 * Progress of a graph that runs inside of another: a run reports its actions by the names of all
 * levels. Pure.
 */

import { useRef } from "react";
import type { Run } from "../api/runs";
import { shiftOfRun } from "../api/site-places";
import { fullName, type Graph } from "../graph/model";
import { placesOf } from "./level-places";
import {
  type Progress,
  progressAt,
  progressByAid,
  progressOfAction,
  type Unsure,
} from "./progress";

/**
 * The way from the outermost graph to one inside: by the names of the graphs below it, as far as nobody knows
 * which of several actions of a name was entered, and then by the very actions that one is inside of.
 */
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

const NONE = {
  word: "",
  since: null,
  took: null,
  atMost: null,
  visits: 0,
  inferred: false,
  message: null,
};

/**
 * Return the progress of a sub-graph that a run has opened, of the actions inside. It is not known where that of one
 * of them is not. Nothing tells how it ended itself, so that no outcome is said: only how many of them have ended.
 */
function foldedProgress(inside: readonly Progress[]): Progress {
  const find = (toned: string) => inside.find(({ tone }) => tone === toned);
  const ends = inside.find(({ word }) => /^(stopping|paused)$/.test(word));
  const first = find("unknown") ?? find("run") ?? ends;
  const all = inside.length;
  const ended = inside.filter(({ tone }) => tone !== "idle").length;
  const none = ended ? `${ended} of ${all} inside ended` : inside[0]?.word;
  const tone = first?.tone ?? (ended < all ? "idle" : "done");
  return { ...NONE, tone, word: first?.word ?? none ?? "" };
}

/**
 * Progress by the keys that the actions have here; those that the run knows under no such name have none. `folded`: only
 * of actions that stand for sub-graphs which the run has opened.
 */
export function progressInside(
  run: Run,
  unsure: Unsure,
  inside: GraphInRun,
  folded = false,
): Map<string, Progress> {
  const keys = new Map(inside.graph.actions.map((action) => [fullName(action), action.key]));
  const found = new Map<string, Progress>();
  const opened = new Map<string, Progress[]>();
  const places = placesOf(run);
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    const levels = action.levels ?? [];
    const depth = levels.findIndex((_, i) => isThere(levels.slice(0, i), inside));
    const place = places.get(name);
    const isOwn = !folded && place !== undefined && isThere(place.levels, inside);
    const key = keys.get(levels[depth] ?? (isOwn ? place.name : ""));
    if (key === undefined) continue;
    const progress = progressOfAction(name, action, run, unsure);
    if (depth < 0) found.set(key, progress);
    else opened.set(key, [...(opened.get(key) ?? []), progress]);
  }
  for (const [key, each] of opened) found.set(key, foldedProgress(each));
  return found;
}

/** Return whether a run reports any action of the level. */
export function isInRun(run: Run, names: readonly string[]): boolean {
  return [...placesOf(run).values()].some(({ levels }) => isThere(levels, { names }));
}

/**
 * Progress of the actions of a graph that is drawn inside of the one on the canvas: the actions `levels` lead
 * from there to it, by their full names.
 */
export function progressBelow(
  { run, unsure, at, names }: RunOnCanvas,
  graph: Pick<Graph, "actions">,
  levels: readonly string[],
): ReadonlyMap<string, Progress> {
  return progressAt(progressInside(run, unsure, { graph, names, levels }), at, shiftOfRun(run.id));
}

export type ProgressByAid = ReadonlyMap<string, Progress>;

function keptProgress(before: ProgressByAid, now: ProgressByAid): ProgressByAid {
  if (before.size !== now.size) return now;
  for (const [key, progress] of now) if (!isSame(before.get(key), progress)) return now;
  return before;
}

/** Returns whether both show the same. Progress folded of several actions is a new object each time, and has no name. */
function isSame(before: Progress | undefined, now: Progress): boolean {
  return before === now || (!now.name && !before?.name && before?.word === now.word);
}

/**
 * Return the progress of the actions of the graph on the canvas, by their keys; the same map while nothing changes.
 * `at`: the moment at which a replay stands, ms. `inside`: what is shown is a graph inside of the run's. `graph`: what
 * is shown is the graph of the run as people draw it: the run may have opened its sub-graphs.
 */
export function useProgress(
  run: Run | null,
  unsure: Unsure,
  at: number | null = null,
  inside: GraphInRun | null = null,
  graph: GraphInRun["graph"] | null = null,
): ProgressByAid {
  const last = useRef<ProgressByAid>(new Map());
  const found = run && inside ? progressInside(run, unsure, inside) : progressByAid(run, unsure);
  if (run && graph && !inside)
    for (const [key, each] of progressInside(run, unsure, { graph, names: [] }, true))
      found.set(key, each);
  const now = progressAt(found, at, shiftOfRun(run?.id ?? ""));
  last.current = keptProgress(last.current, now);
  return last.current;
}
