/** Robots as the runner tells them, and what it looks at before a start. */
import { queryOptions, useQuery } from "@tanstack/react-query";
import { runnerAt, runnerOnlyAt } from "./client";
import { fetchText } from "./http";
import type { RunnerApi } from "./schema/runner";
import { runnerOfRobot, takenElsewhere } from "./site-places";

export const SIMULATOR = "simulator";

/**
 * A robot, or the simulator. `servers`: how many answer on the path of its get, where one makes answers
 * a proof; `others`: programs beside this one that publish starts.
 */
export type Robot = RunnerApi["Robot"];
/** `failure`: why it failed, "" if it passed; `proof_ms`: null where nothing proved the Stop. */
export type Drill = RunnerApi["DrillShown"];
export type EngineState = Robot["state"];
/**
 * A graph that an engine holds, ended ones too. `stopping`: why a stop of it is not proven yet, "" at
 * first; null when nobody wants that.
 */
export type HeldGraph = RunnerApi["HeldGraph"];
export type Registration = Required<RunnerApi["Registration"]>;
/** An engine in sight that nobody registered. An idle one does not say its name. */
export type FoundEngine = RunnerApi["Candidate"];
export type IndexedByRobot = RunnerApi["RobotKnowledge"];
/** A line of a robot's log. `has_graph`: its graph can be fetched. */
export type RobotLogLine = RunnerApi["RobotLogLine"];
/** One thing that was looked at before a start. */
export type PreflightItem = RunnerApi["Item"];
/**
 * `override`: the codes that a person would have to answer for; `never`: something stands in the way
 * that cannot be overridden.
 */
export type Preflight = RunnerApi["Preflight"];

const path = (runner: string, name: string) =>
  `${runnerOfRobot(runner, name)}/api/robots/${encodeURIComponent(name)}`;

/** Query whether the runner can reach robots over ROS 2, and the reason if not. */
export function useRosReach(runner: string | undefined) {
  return useQuery({
    queryKey: ["robots", "reach", runner],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/reach", { signal }),
    enabled: runner !== undefined,
  });
}

/** Engines in sight of one runner. While discovery goes on it is asked again soon, and says for how long others may still come. */
export function useFoundEngines(runner: string | undefined, on: boolean) {
  return useQuery({
    queryKey: ["robots", "candidates", runner],
    queryFn: ({ signal }) => runnerOnlyAt(runner ?? "").get("/api/candidates/now", { signal }),
    enabled: on && runner !== undefined,
    refetchInterval: ({ state }) => ((state.data?.left_s ?? 0) > 0 ? 500 : 5_000),
  });
}

/** The query of what a robot has indexed. */
export const indexQuery = (runner: string | undefined, name: string) =>
  queryOptions({
    queryKey: ["robots", "known", name],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/robots/{name}/known", { path: { name }, signal }),
    enabled: runner !== undefined,
  });

export function useIndexedByRobot(runner: string | undefined, robot: string) {
  return useQuery({ ...indexQuery(runner, robot), refetchInterval: 10_000 });
}

/** The file of an action that a robot has indexed. */
export function indexedAction(runner: string, robot: string, action: string): Promise<string> {
  return fetchText(`${path(runner, robot)}/known/${encodeURIComponent(action)}`);
}

export function useRobotLog(runner: string | undefined, robot: string, on: boolean) {
  return useQuery({
    queryKey: ["robots", "flight", robot],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/robots/{name}/events", { path: { name: robot }, signal }),
    enabled: on && runner !== undefined,
    refetchInterval: 3_000,
  });
}

/**
 * Register a robot. `runner`: of the site that is to lead it. Throws if another site has a robot of this name, or may
 * have one.
 */
export async function registerRobot(runner: string, robot: Registration): Promise<Robot> {
  const taken = takenElsewhere(robot.name, runner);
  if (taken !== "") throw new Error(taken);
  return runnerOnlyAt(runner).post("/api/robots", { body: robot });
}

/** The name of the robot that a runner starts for practice. */
export const PRACTICE = "Practice";

/** Starts an emulated robot on the computer of the runner, and registers it. Throws as `registerRobot` does. */
export async function startPracticeRobot(runner: string): Promise<Robot> {
  const taken = takenElsewhere(PRACTICE, runner);
  if (taken !== "") throw new Error(taken);
  return runnerOnlyAt(runner).post("/api/practice", {});
}

export function changeRobot(runner: string, robot: Registration): Promise<Robot> {
  const { name, ...body } = robot;
  return runnerAt(runner).patch("/api/robots/{name}", { path: { name }, body });
}

export function forgetRobot(runner: string, name: string): Promise<unknown> {
  return runnerAt(runner).delete("/api/robots/{name}", { path: { name } });
}

/** Stops whatever a robot runs, whoever started it. */
export function stopRobot(runner: string, name: string): Promise<unknown> {
  return runnerAt(runner).post("/api/robots/{name}/stop", { path: { name }, timeoutMs: 6_000 });
}

/** A graph that a robot holds, as text to import. */
export function heldGraph(runner: string, name: string, graph: string): Promise<string> {
  return fetchText(`${path(runner, name)}/umrf?graph=${encodeURIComponent(graph)}`);
}

/** The graph of a recorded command, as text to import. */
export function commandedGraph(runner: string, name: string, seq: number): Promise<string> {
  return fetchText(`${path(runner, name)}/events/${seq}/umrf`);
}
