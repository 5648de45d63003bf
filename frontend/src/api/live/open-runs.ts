/** What goes on, as far as this page knows: runs of ours, and what robots run besides. Pure. */
import type { HeldGraph, Robot } from "../robots";
import type { Run } from "../runs";
import type { LiveState, StopRequest } from "./live-socket";

/** The runs that go on, newest first, as far as this page knows. */
export function openRuns(now: LiveState): Run[] {
  return [...now.runs.values()]
    .filter((run) => run.ended_at === null)
    .sort((a, b) => b.number - a.number);
}

/** The newest run of a graph that this page has heard of live. */
export function newestRun(now: LiveState, graph: string): Run | null {
  let newest: Run | null = null;
  for (const run of now.runs.values()) {
    if (run.graph === graph && (newest === null || run.number > newest.number)) newest = run;
  }
  return newest;
}

/** What robots run that nobody started from here, as `robot: graph`. Sub-graphs belong to theirs. */
export function foreignGraphs(now: LiveState): { robot: Robot; held: HeldGraph }[] {
  return now.engines.flatMap((robot) => {
    const moving = robot.holds.filter((held) => held.active);
    const tops = moving.filter((held) => !moving.some((top) => isPart(held.graph, top.graph)));
    return tops.filter((held) => !isOurs(now, robot, held)).map((held) => ({ robot, held }));
  });
}

function isPart(graph: string, top: string): boolean {
  return graph !== top && graph.startsWith(`${top}__`);
}

function isOurs(now: LiveState, robot: Robot, held: HeldGraph): boolean {
  return openRuns(now).some(
    (run) =>
      run.engine === robot.name && (run.id === held.run || isPart(held.graph, run.graph_name)),
  );
}

/** Robots that do not answer now: what they run is not known. */
export function unheardRobots(now: LiveState): Robot[] {
  return now.engines.filter(
    ({ simulated, state }) => !simulated && state !== "answering" && state !== "restarted",
  );
}

/** The runs that a Stop is about, as far as this page knows them. */
export function stopTargets(stop: StopRequest, now: LiveState): Run[] {
  const all = stop.run === "all";
  return [...now.runs.values()].filter((run) =>
    all ? stop.runs.includes(run.id) : [run.id, run.group].includes(stop.run),
  );
}

/** Whether the runner says, and says it now, that all rests that a Stop is about. */
export function isProven(stop: StopRequest, now: LiveState): boolean {
  if (now.link !== "live" || stop.state !== "heard") return false;
  const runs = stopTargets(stop, now);
  if (runs.some((run) => run.ended_at === null || run.state === "lost")) return false;
  if (stop.run !== "all") return runs.length > 0;
  return foreignGraphs(now).length === 0 && unheardRobots(now).length === 0;
}
