/** The actions of a run as lanes of its timeline. */
import { useRef } from "react";
import type { Run } from "../../api/runs";
import { isEqual } from "../../graph/equal";
import { fullName, type Graph } from "../../graph/model";

export interface Lane {
  name: string;
  aid: string | null;
  robot: string;
}

/** Every action, those that ran first, in the order in which they began. `robot` is whose they are
 * where the graph does not say. */
export function lanesOf(run: Run, graph: Graph, robot = ""): Lane[] {
  const known = new Map(graph.actions.map((action) => [fullName(action), action]));
  const own = Object.keys(run.actions ?? {});
  const names = own.length > 0 ? own : [...known.keys()];
  const began = (name: string) => run.actions?.[name]?.visits[0]?.from ?? "~";
  return names
    .map((name) => ({
      name,
      aid: run.actions?.[name]?.aid ?? known.get(name)?.key ?? null,
      robot: known.get(name)?.actor || robot,
    }))
    .sort((a, b) => {
      const [x, y] = [began(a.name), began(b.name)];
      return x < y ? -1 : x > y ? 1 : 0;
    });
}

/** Whose lanes they are, in their order. */
export function robotsOf(lanes: readonly Lane[]): string[] {
  return [...new Set(lanes.map((lane) => lane.robot))];
}

/** The lanes of a run for React; while nothing begins they are the same objects. */
export function useLanes(run: Run | null, graph: Graph, robot = ""): readonly Lane[] {
  const last = useRef<readonly Lane[]>([]);
  const now = run === null ? [] : lanesOf(run, graph, robot);
  if (!isEqual(last.current, now)) {
    const known = new Map(last.current.map((lane) => [lane.name, lane]));
    last.current = now.map((lane) => {
      const before = known.get(lane.name);
      return before !== undefined && isEqual(before, lane) ? before : lane;
    });
  }
  return last.current;
}
