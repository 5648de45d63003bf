/** Actions that robots have indexed: beside those of the library. */
import { useQueries } from "@tanstack/react-query";
import { useMemo } from "react";
import type { GraphSummary } from "../api/graphs";
import { importAction } from "../api/library";
import { useLive } from "../api/page-link";
import { type IndexedByRobot, indexedAction, indexQuery } from "../api/robots";
import { flatName, pathOf } from "../graph/document-keys";
import type { NewAction } from "../graph/edit";
import { pathWords } from "../graph/field-words";
import { isolated } from "../words/isolated";

export type IndexedAction = IndexedByRobot["actions"][number];

/** Action that one robot has under a name. */
export interface RobotAction {
  readonly robot: string;
  readonly action: IndexedAction;
}

/** Actions that each robot has indexed. `unknown`: robots that have not told theirs. */
export interface RobotsKnowledge {
  readonly robots: readonly string[];
  readonly unknown: readonly string[];
  readonly byName: ReadonlyMap<string, readonly RobotAction[]>;
  /** The robots that have a graph, by its name. */
  readonly graphs: ReadonlyMap<string, readonly string[]>;
}

/** The index of each robot; null if it has told none. */
type ToldByRobots = readonly { readonly robot: string; readonly indexed: IndexedByRobot | null }[];

export function knowledgeOf(told: ToldByRobots): RobotsKnowledge {
  const byName = new Map<string, RobotAction[]>();
  const graphs = new Map<string, string[]>();
  for (const { robot, indexed } of told) {
    for (const action of indexed?.actions ?? []) {
      byName.set(action.name, [...(byName.get(action.name) ?? []), { robot, action }]);
    }
    for (const name of indexed?.graphs ?? []) {
      graphs.set(name, [...(graphs.get(name) ?? []), robot]);
    }
  }
  return {
    robots: told.map(({ robot }) => robot),
    unknown: told.flatMap(({ robot, indexed }) => (indexed === null ? [robot] : [])),
    byName,
    graphs,
  };
}

/** Query the indexes of several robots at once; null for robots that have not answered. */
function useIndexedByRobots(
  runner: string | undefined,
  robots: readonly string[],
): readonly { readonly robot: string; readonly indexed: IndexedByRobot | null }[] {
  return useQueries({
    queries: robots.map((robot) => ({
      ...indexQuery(runner, robot),
      refetchInterval: 30_000,
    })),
    combine: (answers) =>
      answers.map(({ data }, i) => ({ robot: robots[i] ?? "", indexed: data ?? null })),
  });
}

export function useRobotsKnowledge(): RobotsKnowledge {
  const { runner, now } = useLive();
  const names = now.engines.flatMap(({ simulated, name }) => (simulated ? [] : [name])).join("\n");
  const robots = useMemo(() => (names === "" ? [] : names.split("\n")), [names]);
  const told = useIndexedByRobots(runner, robots);
  const said = JSON.stringify(told);
  return useMemo(() => knowledgeOf(JSON.parse(said)), [said]);
}

type Types = Readonly<Record<string, string>>;

const parameters = (types: Types) =>
  Object.entries(types).map(([flat, type]) => ({
    path: pathOf(flat.split("::")),
    text: JSON.stringify({ pvf_type: type }),
  }));

/** Return the values with which a new use of the action begins. */
export function robotTemplate({ name, inputs, outputs }: IndexedAction): NewAction {
  return { name, type: "sync", inputs: parameters(inputs), outputs: parameters(outputs) };
}

/** A parameter, as far as robots tell them. */
interface TypedParameter {
  readonly path: string;
  readonly pvf_type: string | null;
}

function sideDifferences(own: readonly TypedParameter[], theirs: Types, what: string): string[] {
  const known = new Map(own.map(({ path, pvf_type }) => [flatName(path), { path, pvf_type }]));
  const missing = [...known].flatMap(([flat, { path }]) =>
    flat in theirs ? [] : [`no ${what}${pathWords(path)}`],
  );
  const others = Object.entries(theirs).flatMap(([flat, type]) => {
    const name = what + flat.replaceAll("::", ".");
    const mine = known.get(flat);
    if (mine === undefined) return [`${isolated(name)} besides`];
    return mine.pvf_type === type || mine.pvf_type === null ? [] : [`${isolated(name)} is ${type}`];
  });
  return [...missing, ...others];
}

/** Return how the action of a robot differs from that of the library; nothing if it does not. */
export function robotDifferences(
  own: { readonly inputs: readonly TypedParameter[]; readonly outputs: readonly TypedParameter[] },
  theirs: IndexedAction,
): string[] {
  return [
    ...sideDifferences(own.inputs, theirs.inputs, ""),
    ...sideDifferences(own.outputs, theirs.outputs, "output "),
  ];
}

export async function takeFromRobot(
  runner: string | undefined,
  { robot, action }: RobotAction,
): Promise<GraphSummary> {
  if (runner === undefined) throw new Error("The runner’s address is not known.");
  return importAction(await indexedAction(runner, robot, action.name));
}
