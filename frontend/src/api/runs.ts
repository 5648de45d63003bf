/** Runs as the runner tells them. */

import { useQuery } from "@tanstack/react-query";
import type { RunBreakpoint } from "../graph/breakpoints";
import { isolated } from "../words/isolated";
import { editor, runnerAt } from "./client";
import { enginesOf, type LedOrder } from "./led-runs";
import { getRun, type Run } from "./run-stop";
import type { RunnerApi } from "./schema/runner";

/**
 * Person who asked for something, and the address; `address` is missing for the runner's own
 * computer.
 */
export type Requester = RunnerApi["Author"];
/** Seconds: at least `least`, at most `most`; null: nothing bounds it from above. */
export type DurationBounds = RunnerApi["DurationBounds"];
/** One execution: it began between `not_before` and `from`, and ended between `until` and
 * `not_after` (null: it may go on still). Where `until` lies before `from`, no moment is known at
 * which it went on for certain. */
export type Visit = RunnerApi["VisitShown"];
export type ActionRun = RunnerApi["ActionShown"];
export type { Run };

/** Return the address of a person as words that follow `actorWords`; "" if none was recorded. */
export function requesterPlace(asker: Requester | null): string {
  if (asker?.by === undefined) return "";
  const means = asker.program ? "" : `by ${isolated(asker.by)}, `;
  return ` · ${means}from ${asker.address ?? "this computer"}`;
}

/** Return in a few words on which engines a run ran. */
export function runPlace(run: Run): string {
  if (run.robots) return enginesOf(run).join(", ");
  if (!run.simulated) return run.engine;
  return run.engine === "simulator" ? "simulator" : `${isolated(run.engine)} (simulated)`;
}

/** The engine whose abilities count: the simulator has those of the robot that it plays. */
export function abilitiesOf(run: Run): string {
  return run.like ?? run.engine;
}

/** The newest alarm that still holds: that nothing moves is over once something has begun. */
export function currentAlarm(run: Run): Run["alarms"][number] | undefined {
  const begun = Object.values(run.actions ?? {}).map(({ visits }) => visits.at(-1)?.from ?? "");
  const newest = Math.max(0, ...begun.map((at) => Date.parse(at) || 0));
  return run.alarms.findLast(({ code, at }) => code !== "stalled" || Date.parse(at) >= newest);
}

/** Says that somebody has seen the run at rest, and how. */
export function confirmRest(runner: string, run: string, how: string): Promise<Run> {
  return runnerAt(runner).post("/api/runs/{run}/at_rest", { path: { run }, body: { how } });
}

/** The graphs inside, by value. Nothing where there are none: then nobody needs to know of them. */
export interface Inside {
  subgraphs?: RunnerApi["SentSubgraph"][];
  tree_digest?: string;
}

export interface StartOrder {
  runner: string;
  version: string;
  digest: string;
  /** JSON text, sent exactly as the editor gave it. */
  umrf: string;
  graph: string;
  /** One engine, or several robots that start together; only `CONDUCTED` for a led run. */
  engines: readonly string[];
  led?: LedOrder;
  request: string;
  /** Outcomes of actions; only the simulator follows them. */
  script?: RunnerApi["Script"];
  /** Set if actions follow their Python behaviours; only in the simulator. */
  behaviours?: boolean;
  override?: RunnerApi["Override"];
  inside?: Inside;
  /** The robots that the person says to watch. */
  watching?: Watching;
  /** Set for a start by which a Stop drill is made. */
  drill?: boolean;
  /** Breakpoints at which a led run waits. */
  breakpoints?: readonly RunBreakpoint[];
  /** Values of the inputs for which the graph asks. */
  values?: NonNullable<Run["values"]>;
  /** The place where it begins, if not at the entry. */
  from?: RunnerApi["StartFrom"];
}

/** True for each robot that a person says to watch. */
export type Watching = Readonly<Record<string, true>>;

/** `failed`: robots that nothing was sent to, and why. */
export type Started = Pick<RunnerApi["GroupShown"], "runs" | "failed">;

/**
 * The rules of a version as the editor seals them, for the runner. Nothing if the editor has none or
 * does not answer: where there are rules, only its starter and owners see the run then.
 */
export async function sightOf(version: string): Promise<{ sight?: RunnerApi["Sight"] }> {
  if (version === "") return {};
  try {
    const path = { version_id: version };
    return {
      sight: await editor.get("/api/versions/{version_id}/sight", { path, timeoutMs: 3000 }),
    };
  } catch {
    return {};
  }
}

const asBreakpoints = (
  given: readonly RunBreakpoint[] = [],
): { breakpoints?: RunnerApi["Breakpoint"][] } =>
  given.length === 0 ? {} : { breakpoints: given as RunnerApi["Breakpoint"][] };

/** Starts a version by value. The same `request` never starts twice. */
export async function startRun(order: StartOrder): Promise<Started> {
  const [engine = "", ...others] = order.engines;
  const runner = runnerAt(order.runner);
  const body = await startBody(order);
  if (others.length > 0) {
    return runner.post("/api/groups", { body: { ...body, engines: order.engines } });
  }
  const run = await runner.post("/api/runs", { body: { ...body, engine } });
  return { runs: [run], failed: {} };
}

/** A start as it is sent, without its engines. */
export async function startBody(order: StartOrder) {
  return {
    version: order.version,
    digest: order.digest,
    graph: order.graph,
    request_id: order.request,
    ...(order.override === undefined ? {} : { override: order.override }),
    ...(order.script === undefined ? {} : { script: order.script }),
    ...(order.behaviours === true ? { behaviours: true } : {}),
    ...order.led,
    ...(await sightOf(order.version)),
    ...(order.watching === undefined ? {} : { watching: order.watching }),
    ...(order.drill === true ? { drill: true } : {}),
    ...asBreakpoints(order.breakpoints),
    ...(order.values === undefined ? {} : { values: order.values }),
    ...(order.from === undefined ? {} : { from: order.from }),
    umrf: order.umrf,
    ...order.inside,
  };
}

/** The runner's knowledge of a start. Without runs and not `under_way`: it has none so far. */
export type StartFound = RunnerApi["StartShown"];

export function findStart(
  runner: string,
  request: string,
  patience: number,
  signal?: AbortSignal,
): Promise<StartFound> {
  const path = { request_id: request };
  return runnerAt(runner).get("/api/starts/{request_id}", { path, timeoutMs: patience, signal });
}

export function pauseRun(runner: string, run: string): Promise<Run> {
  return runnerAt(runner).post("/api/runs/{run}/pause", { path: { run } });
}

/** Lets a paused run go on. */
export function resumeRun(runner: string, run: string, watching: Watching): Promise<Run> {
  return runnerAt(runner).post("/api/runs/{run}/resume", { path: { run }, body: { watching } });
}

export function useRuns(runner: string | undefined) {
  return useQuery({
    queryKey: ["runs", "list"],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/runs", { query: { limit: 200 }, signal }),
    enabled: runner !== undefined,
  });
}

/** The newest run of a graph, whole; null when it never ran. */
export function useLastRun(runner: string | undefined, graph: string) {
  return useQuery({
    queryKey: ["runs", "last", graph],
    queryFn: async ({ signal }) => {
      const query = { limit: 1, graph };
      const [newest] = await runnerAt(runner).get("/api/runs", { query, signal });
      return newest ? getRun(runner ?? "", newest.id, signal) : null;
    },
    enabled: runner !== undefined,
  });
}

export function useRun(runner: string | undefined, id: string) {
  return useQuery({
    queryKey: ["runs", "one", id],
    queryFn: ({ signal }) => getRun(runner ?? "", id, signal),
    enabled: runner !== undefined,
  });
}
