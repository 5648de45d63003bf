/** Takes an action over from a robot, as its own file describes it. */
import { importAction } from "../api/documents/library";
import type { GraphSummary } from "../api/graphs";
import { indexedAction } from "../api/robots";
import type { RobotAction } from "./robot-actions";

export async function takeFromRobot(
  runner: string | undefined,
  { robot, action }: RobotAction,
): Promise<GraphSummary> {
  if (runner === undefined) throw new Error("The runner’s address is not known.");
  return importAction(await indexedAction(runner, robot, action.name));
}
