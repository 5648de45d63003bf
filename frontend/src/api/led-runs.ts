/** Runs that the runner leads on several robots, one action at a time. */
import { isolated } from "../words/isolated";
import type { Run } from "./run-stop";

/** The engine that a led run names; its robots stand in `robots`. */
export const CONDUCTED = "conducted";

/**
 * The choices of a led start. `robots`: the engine of each actor, "" being the actor of actions that
 * name none; `lost`: the reaction when a robot does not answer or its action fails.
 */
export interface LedOrder {
  readonly robots: Readonly<Record<string, string>>;
  readonly lost: "stop" | "wait";
  /** The group or person that answers the questions of each role; "" for all who may run it. */
  readonly people?: Readonly<Record<string, string>>;
  /** Set if sub-graphs are opened: the actions inside of them are steps of their own. */
  readonly levels?: "opened";
}

/** Return the engines that carry out a run, sorted: one, or all those of a led run. */
export function enginesOf(run: Pick<Run, "engine" | "robots">): string[] {
  if (!run.robots) return [run.engine];
  return [...new Set(Object.values(run.robots))].sort();
}

/** Return the engines of a run to stand within a sentence. */
export function engineWords(run: Pick<Run, "engine" | "robots">): string {
  return enginesOf(run).map(isolated).join(", ");
}

/** Return whether a graph that a robot holds may be an action that a led run has sent to it. */
export function isPieceOf(run: Run, robot: string, graph: string): boolean {
  return enginesOf(run).includes(robot) && graph.startsWith(`${run.graph_name}--`);
}
