/** The robots of a graph, by the `actor` of its actions, and the arrows that lead from one robot to another. */
import { isolated } from "../words/isolated";
import type { Action, Graph, Key, Relation, Response } from "./model";

/** Return the number of actions of each robot, by name; those for any robot ("") come last. */
export function robotCounts(
  actions: readonly Pick<Action, "actor" | "missing">[],
): [name: string, actions: number][] {
  const counts = new Map<string, number>();
  for (const { actor, missing } of actions)
    if (!missing) counts.set(actor, (counts.get(actor) ?? 0) + 1);
  return [...counts].sort(([a], [b]) => (a === "" ? 1 : b === "" ? -1 : a.localeCompare(b)));
}

/** Return the names of the robots that actions of a graph belong to, sorted. */
export function robotNames(actions: Parameters<typeof robotCounts>[0]): string[] {
  return robotCounts(actions).flatMap(([name]) => (name === "" ? [] : [name]));
}

/** Return whether a graph has several robots: its actions name two or more. */
export function hasSeveralRobots(actions: Parameters<typeof robotCounts>[0]): boolean {
  return robotNames(actions).length > 1;
}

export type RobotOf = ReadonlyMap<Key, string>;

/**
 * Return the robot of each action by key, in a graph of several robots; empty for any other graph.
 * "": any robot, which is a performer of its own beside those that are named.
 */
export function robotOf({ actions }: Pick<Graph, "actions">): RobotOf {
  if (!hasSeveralRobots(actions)) return new Map();
  return new Map(actions.flatMap(({ key, actor, missing }) => (missing ? [] : [[key, actor]])));
}

/** An arrow between actions of two robots. */
export interface HandOver {
  readonly from: string;
  readonly to: string;
  /** The second robot's action waits for the first one's; false where the arrow is optional. */
  readonly waits: boolean;
}

const IDLE: ReadonlySet<Response> = new Set(["ignore", "restart"]);

/** Return whether a response to an end makes an action do anything; engines do nothing for `restart`. */
export const isResponding = (response: Response): boolean => !IDLE.has(response);

/** Return the two robots of an arrow; null where both actions are one robot's, or it does nothing. */
export function handOverOf(relation: Relation, robots: RobotOf): HandOver | null {
  const [from, to] = [robots.get(relation.parent), robots.get(relation.child)];
  if (from === undefined || to === undefined || from === to || relation.only !== null) return null;
  if (!Object.values(relation.conditions).some(isResponding)) return null;
  return { from, to, waits: relation.required };
}

/** Return an arrow between two robots in a few words. */
export function handOverLabel({ from, to, waits }: HandOver): string {
  const [first, second] = [robotWord(from), robotWord(to)];
  return waits ? `${second} waits for ${first}` : `from ${first} to ${second}`;
}

/** Return the name of a robot to stand within a sentence. */
export const robotWord = (name: string): string => (name === "" ? "any robot" : isolated(name));
