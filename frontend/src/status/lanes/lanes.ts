/** The actions of a run as lanes of its timeline. */
import { useRef } from "react";
import type { Run } from "../../api/runs";
import { fullName, type Graph, type Key } from "../../graph/model";
import { isEqual } from "../../graph/values";
import { factOf, type LevelPlace, placesIn, placesOf } from "../level-places";
import { type Needs, needsIn } from "../waits";

export interface Lane {
  /** Name by which the run reports the action. */
  name: string;
  /** Its own name in its level. */
  label: string;
  aid: string | null;
  robot: string;
  /** The actions that it is inside of, outermost first. */
  levels: readonly string[];
  /** The lane of the action that it is right inside of. */
  around: string | null;
  /** Set if it has inner lanes. */
  holds: boolean;
  /** The actions of other robots that it waits for, by names of lanes; left out if there are none. */
  needs?: Needs;
}

type Sorted = Map<string | null, { name: string; place: LevelPlace }[]>;

/**
 * Return the actions directly inside of each action, in the order in which they began; those that
 * never ran come last.
 */
function byAround(run: Run, places: ReadonlyMap<string, LevelPlace>): Sorted {
  const began = (name: string) => run.actions?.[name]?.visits[0]?.from ?? "~";
  const inside: Sorted = new Map();
  for (const [name, place] of places) {
    const { levels } = place;
    const around = levels.length === 0 ? null : factOf(run.graph_name, levels);
    const beside = inside.get(around);
    if (beside === undefined) inside.set(around, [{ name, place }]);
    else beside.push({ name, place });
  }
  for (const beside of inside.values())
    beside.sort((a, b) => {
      const [x, y] = [began(a.name), began(b.name)];
      return x < y ? -1 : x > y ? 1 : 0;
    });
  return inside;
}

/** The needs of actions by their full names, which lanes have in a run. */
function needsByName(graph: Graph | null): ReadonlyMap<string, Needs> {
  if (graph === null) return new Map();
  const names = new Map(graph.actions.map((action) => [action.key, fullName(action)]));
  const nameOf = (key: Key) => names.get(key) ?? "";
  return new Map(
    [...needsIn(graph)].map(([key, { parents, others }]) => [
      nameOf(key),
      {
        parents: parents.map(nameOf),
        others: others.map(({ key, words }) => ({ key: nameOf(key), words })),
      },
    ]),
  );
}

/** Every action, those that ran first, in the order in which they began, and right below each those inside
 * of it. In a led run they are the robot's that carried them out; `robot` is whose they are where
 * the graph does not say. `sent`: the graph that runs, as far as it is known. */
export function lanesOf(run: Run, graph: Graph, robot = "", sent: Graph | null = graph): Lane[] {
  const needs = needsByName(sent);
  const known = new Map(graph.actions.map((action) => [fullName(action), action]));
  const own = Object.keys(run.actions ?? {});
  const places = own.length > 0 ? placesOf(run) : placesIn(run.graph_name, new Set(), known.keys());
  const inside = byAround(run, places);
  const lanes: Lane[] = [];
  const put = (around: string | null, whose: string | null) => {
    for (const { name, place } of inside.get(around) ?? []) {
      const aid = run.actions?.[name]?.aid ?? known.get(name)?.key ?? null;
      const its = whose ?? (run.actions?.[name]?.robot || known.get(name)?.actor || robot);
      const holds = inside.has(name);
      const { levels, name: label } = place;
      const need = levels.length === 0 ? needs.get(name) : undefined;
      const waits = need && { needs: need };
      lanes.push({ name, label, aid, robot: its, levels, around, holds, ...waits });
      if (holds) put(name, its);
    }
  };
  put(null, null);
  return lanes;
}

/** Return the lanes that are visible while only these are open. */
export function openLanes<One extends Pick<Lane, "name" | "around">>(
  lanes: readonly One[],
  open: ReadonlySet<string>,
): One[] {
  const seen = new Set<string>();
  return lanes.filter(({ name, around }) => {
    const shown = around === null || (seen.has(around) && open.has(around));
    if (shown) seen.add(name);
    return shown;
  });
}

/** Names for those who carry out actions that no robot does, by the word that a run has for them. */
const NO_ROBOTS: ReadonlyMap<string, string> = new Map([
  ["people", "People"],
  ["runner", "The runner"],
]);

/** Return whether this is a robot, and not people or the runner. */
export const isRobot = (performer: string): boolean => !NO_ROBOTS.has(performer);

/** Return who carries actions out, as people read it. */
export const performerWords = (performer: string): string =>
  NO_ROBOTS.get(performer) ?? (performer === "" ? "any robot" : performer);

/** Returns the robots of the lanes, in the order of the lanes. */
export function robotsOf(lanes: readonly Lane[]): string[] {
  return [...new Set(lanes.map((lane) => lane.robot))];
}

/** The lanes of a run for React; while nothing begins they are the same objects. */
export function useLanes(
  run: Run | null,
  graph: Graph,
  robot = "",
  sent: Graph | null = graph,
): readonly Lane[] {
  const last = useRef<readonly Lane[]>([]);
  const now = run === null ? [] : lanesOf(run, graph, robot, sent);
  if (!isEqual(last.current, now)) {
    const known = new Map(last.current.map((lane) => [lane.name, lane]));
    last.current = now.map((lane) => {
      const before = known.get(lane.name);
      return before !== undefined && isEqual(before, lane) ? before : lane;
    });
  }
  return last.current;
}
