/** What is said of a graph that runs inside of another: its actions are told by the names of all levels. Pure. */
import type { Run } from "../api/runs";
import { type Action, fullName, type Graph } from "../graph/model";
import { Watched } from "../ui/watched";
import { type Progress, progressAt, progressOfAction } from "./progress";

/** By its name alone where nobody knows which of several actions of that name was entered. */
export type LevelName = string | Pick<Action, "name" | "instanceId">;

/** A graph in a run of the outermost one around it. */
export interface GraphInRun {
  readonly graph: Pick<Graph, "actions">;
  /** The names of the graphs below the outermost one, down to this one. */
  readonly names: readonly LevelName[];
}

/** The run whose states are on the canvas. */
export interface RunOnCanvas {
  readonly run: Run;
  readonly unsure: boolean;
  /** The moment at which its replay stands, ms. */
  readonly at: number | null;
  /** The names of the graphs below the run's, down to the one on the canvas. */
  readonly names: readonly LevelName[];
}

/** One for the page: there is one canvas. Null while none is shown. */
export const runOnCanvas = new Watched<RunOnCanvas | null>(null);

const escaped = (text: string): string => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

/** How an engine calls the actions of such a graph: `OUTER__INNER__0/Grip_0` (docs/umrf-and-the-engine.md 2.6). */
function namePattern(outermost: string, names: readonly LevelName[]): RegExp {
  const levels = names
    .map((level) =>
      typeof level === "string"
        ? `__${escaped(level)}__\\d+`
        : `__${escaped(level.name)}__${level.instanceId}`,
    )
    .join("");
  return new RegExp(`^${escaped(outermost)}${levels}/(.+)$`, "s");
}

/** Progress by the keys that the actions have here; those that the run knows under no such name have none. */
export function progressInside(
  run: Run,
  unsure: boolean,
  { graph, names }: GraphInRun,
): Map<string, Progress> {
  const pattern = namePattern(run.graph_name, names);
  const keys = new Map(graph.actions.map((action) => [fullName(action), action.key]));
  const found = new Map<string, Progress>();
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    const key = keys.get(pattern.exec(name)?.[1] ?? "");
    if (key !== undefined) found.set(key, progressOfAction(name, action, run, unsure));
  }
  return found;
}

/** Whether a run has anything of it. */
export function isInRun(run: Run, names: readonly LevelName[]): boolean {
  const pattern = namePattern(run.graph_name, names);
  return Object.keys(run.actions ?? {}).some((name) => pattern.test(name));
}

/** Progress of the actions of a graph that is drawn inside of the one on the canvas. */
export function progressBelow(
  { run, unsure, at, names }: RunOnCanvas,
  graph: Pick<Graph, "actions">,
  below: readonly LevelName[],
): ReadonlyMap<string, Progress> {
  return progressAt(progressInside(run, unsure, { graph, names: [...names, ...below] }), at);
}
