/** What is said of a graph that runs inside of another: its actions are told by the names of all levels. Pure. */
import type { Run } from "../api/runs";
import { fullName, type Graph } from "../graph/model";
import { type Progress, progressOfAction } from "./progress";

/** A graph in a run of the outermost one around it. */
export interface GraphInRun {
  readonly graph: Pick<Graph, "actions">;
  /** The names of the graphs below the outermost one, down to this one. */
  readonly names: readonly string[];
}

const escaped = (text: string): string => text.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

/** How an engine calls the actions of such a graph: `OUTER__INNER__0/Grip_0` (docs/umrf-and-the-engine.md 2.6). */
function namePattern(outermost: string, names: readonly string[]): RegExp {
  const levels = names.map((name) => `__${escaped(name)}__\\d+`).join("");
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
export function isInRun(run: Run, names: readonly string[]): boolean {
  const pattern = namePattern(run.graph_name, names);
  return Object.keys(run.actions ?? {}).some((name) => pattern.test(name));
}
