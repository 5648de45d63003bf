/**
 * The part of runs that Stop needs: whether one goes on, its newest state, and the request. STOP
 * loads this and no list.
 */
import { runnerAt } from "./client";
import { fetchAnswer } from "./http";
import type { RunnerApi } from "./schema/runner";

/** A run as far as it is told: lists leave out its actions, and what is live its graph. */
export type Run = RunnerApi["RunSummary"] & {
  [Part in Exclude<keyof RunnerApi["RunWhole"], keyof RunnerApi["RunSummary"]>]?:
    | RunnerApi["RunWhole"][Part]
    | undefined;
};

/** A lost run has not: nobody has seen it at rest yet. */
export function hasEnded(run: Run): boolean {
  return run.ended_at !== null;
}

/** States of an action whose code was seen to go on. */
export const MOVES: ReadonlySet<string> = new Set([
  "RUNNING",
  "STOPPING",
  "PAUSE_REQUESTED",
  "PAUSED",
]);

/** The states of a robot of a led run in which no answer tells of its rest. */
const SILENT: ReadonlySet<string> = new Set(["silent", "unproven"]);

/** Return the robots of a led run about whose rest only a person at the robot can tell. */
export function silentRests(run: Run): RunnerApi["RobotRestShown"][] {
  return (run.rests ?? []).filter(({ state }) => SILENT.has(state));
}

/** Return whether a person's word can end the run, since no answer of its engine can. */
export function needsRestConfirmation(run: Run): boolean {
  if (hasEnded(run) || run.simulated || run.started_at === null) return false;
  if (silentRests(run).length > 0) return true;
  if (run.state === "lost" || run.unknown_since !== null) return true;
  const moves = Object.values(run.actions ?? {}).some((action) => MOVES.has(action.state));
  return Boolean(run.unconfirmed) && !moves;
}

/** Asks to stop one run, or all of them; `again`: this press was sent before. Throws if what answers does not say which runs it stops. */
export async function postStop(
  runner: string,
  run: string | "all",
  stop: string,
  again = false,
): Promise<RunnerApi["Stopping"]> {
  const path = run === "all" ? "/api/stop" : `/api/runs/${encodeURIComponent(run)}/stop`;
  const request = { method: "POST", body: { stop_id: stop, again }, timeoutMs: 3_000 } as const;
  const answer: unknown = await (await fetchAnswer(`${runner}${path}`, request)).json();
  const runs = (answer as { runs?: unknown } | null)?.runs;
  if (!Array.isArray(runs) || runs.some((each) => typeof each !== "string"))
    throw new Error("What answers there is not the runner.");
  return answer as RunnerApi["Stopping"];
}

export function getRun(runner: string, id: string, signal?: AbortSignal): Promise<Run> {
  return runnerAt(runner).get("/api/runs/{run}", { path: { run: id }, signal });
}
