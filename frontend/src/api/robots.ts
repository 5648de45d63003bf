/** Robots as the runner tells them, and what it looks at before a start. */
import { useQuery } from "@tanstack/react-query";
import type { Problem } from "./graphs";
import { fetchJson, fetchText } from "./http";

export const SIMULATOR = "simulator";

export type EngineState = "answering" | "busy" | "gone" | "restarted" | "no_link";
type Generation = "current" | "older" | "unknown";

/** A graph that an engine holds, ended ones too. */
export interface HeldGraph {
  graph: string;
  state: string;
  active: boolean;
  /** The run of this runner that it is. */
  run: string | null;
  /** Why a stop of it is not proven yet, "" at first; null when nobody wants that. */
  stopping: string | null;
}

export interface Robot {
  name: string;
  simulated: boolean;
  state: EngineState;
  why: string;
  since: string | null;
  domain: number | null;
  rmw: string;
  get_service: string;
  profile: Record<string, unknown>;
  heard_at: string | null;
  took_ms: number | null;
  restarted_at: string | null;
  generation: Generation;
  /** How many answer on the path of its get: one makes answers a proof. */
  servers: number;
  /** Programs beside this one that publish starts. */
  others: number;
  actor: string;
  /** Whether pausing is safe there. */
  pauses: boolean;
  holds: HeldGraph[];
  /** How many it has indexed; null before its first answer. */
  actions: number | null;
  graphs: number | null;
}

export interface Registration {
  name: string;
  domain: number;
  rmw: string;
  get_service: string;
  profile: Record<string, unknown>;
}

/** An engine in sight that nobody registered. An idle one does not say its name. */
export interface FoundEngine {
  domain: number;
  rmw: string;
  get_service: string;
  servers: number;
  actor: string;
  generation: Generation;
  problem: string;
}

export interface IndexedByRobot {
  actions: { name: string; inputs: Record<string, string>; outputs: Record<string, string> }[];
  graphs: string[];
  /** Files of its index that cannot be read. */
  unread: number;
}

/** A line of a robot's log. */
export interface RobotLogLine {
  seq: number;
  at: string;
  kind: "commanded" | "became" | "stop_asked" | "stop_proven" | "stop_unproven";
  command: string;
  graph: string;
  sender: string;
  state: string;
  why: string;
  run: string | null;
  number: number | null;
  /** Its graph can be fetched. */
  has_graph: boolean;
}

/** One thing that was looked at before a start. */
export interface PreflightItem {
  code: string;
  verdict: "passed" | "warned" | "blocked";
  text: string;
  codes: string[];
  overridable: boolean;
  problems: Problem[];
}

export interface Preflight {
  engine: string;
  digest: string;
  items: PreflightItem[];
  /** The codes that a person would have to answer for. */
  override: string[];
  /** Something stands in the way that cannot be overridden. */
  never: boolean;
}

const path = (runner: string | undefined, name: string) =>
  `${runner ?? ""}/api/robots/${encodeURIComponent(name)}`;

/** Whether robots can be reached over ROS 2 from the runner, and the reason where not. */
export function useRosReach(runner: string | undefined) {
  return useQuery({
    queryKey: ["robots", "reach"],
    queryFn: ({ signal }) =>
      fetchJson<{ engines: Robot[]; no_reach: string }>(`${runner}/api/reach`, { signal }),
    enabled: runner !== undefined,
  });
}

export function useFoundEngines(runner: string | undefined, on: boolean) {
  return useQuery({
    queryKey: ["robots", "candidates"],
    queryFn: ({ signal }) => fetchJson<FoundEngine[]>(`${runner}/api/candidates`, { signal }),
    enabled: on && runner !== undefined,
    refetchInterval: 5_000,
  });
}

export function useIndexedByRobot(runner: string | undefined, robot: string, on: boolean) {
  return useQuery({
    queryKey: ["robots", "known", robot],
    queryFn: ({ signal }) => fetchJson<IndexedByRobot>(`${path(runner, robot)}/known`, { signal }),
    enabled: on && runner !== undefined,
    refetchInterval: 10_000,
  });
}

export function useRobotLog(runner: string | undefined, robot: string, on: boolean) {
  return useQuery({
    queryKey: ["robots", "flight", robot],
    queryFn: ({ signal }) => fetchJson<RobotLogLine[]>(`${path(runner, robot)}/events`, { signal }),
    enabled: on && runner !== undefined,
    refetchInterval: 3_000,
  });
}

export function registerRobot(runner: string, robot: Registration): Promise<Robot> {
  return fetchJson(`${runner}/api/robots`, { method: "POST", body: robot });
}

export function changeRobot(runner: string, robot: Registration): Promise<Robot> {
  const { name, ...body } = robot;
  return fetchJson(path(runner, name), { method: "PATCH", body });
}

export function forgetRobot(runner: string, name: string): Promise<unknown> {
  return fetchJson(path(runner, name), { method: "DELETE" });
}

/** Stops whatever a robot runs, whoever started it. */
export function stopRobot(runner: string, name: string): Promise<unknown> {
  return fetchJson(`${path(runner, name)}/stop`, { method: "POST", body: {}, timeoutMs: 6_000 });
}

/** A graph that a robot holds, as text to import. */
export function heldGraph(runner: string, name: string, graph: string): Promise<string> {
  return fetchText(`${path(runner, name)}/umrf?graph=${encodeURIComponent(graph)}`);
}

/** The graph of a recorded command, as text to import. */
export function commandedGraph(runner: string, name: string, seq: number): Promise<string> {
  return fetchText(`${path(runner, name)}/events/${seq}/umrf`);
}

/** What stands between a graph and its start, engine by engine. Sends nothing but a get. */
export function runPreflight(
  runner: string,
  umrf: string,
  engines: readonly string[],
  signal: AbortSignal,
): Promise<Preflight[]> {
  const head = JSON.stringify({ engines });
  const body = `${head.slice(0, -1)},"umrf":${umrf}}`;
  return fetchJson(`${runner}/api/preflight`, { method: "POST", body, signal });
}
