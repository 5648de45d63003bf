/** Before a start: what is looked at, and who has said yes. */

import type { RunBreakpoint } from "../graph/breakpoints";
import { editor, runnerAt } from "./client";
import type { LedOrder } from "./led-runs";
import type { Preflight } from "./robots";
import type { Inside, Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";

export type Approval = RunnerApi["Approval"];

/** Fetch the people who approved exactly the graph with this digest. */
export function fetchApprovals(
  runner: string,
  digest: string,
  signal: AbortSignal,
): Promise<Approval[]> {
  return runnerAt(runner).get("/api/approvals", { query: { digest }, signal });
}

/** Ask others for their yes by mail or webhook. Returns to how many receivers the question goes. */
export async function askApproval(
  runner: string,
  question: Omit<RunnerApi["ApprovalQuestion"], "graph_name" | "graph"> & { graph: string },
): Promise<number> {
  const { name } = await editor.get("/api/graphs/{graph_id}", {
    path: { graph_id: question.graph },
  });
  const body = { ...question, graph_name: name };
  return (await runnerAt(runner).post("/api/approvals/asked", { body })).receivers;
}

export function approve(runner: string, body: RunnerApi["ApprovalRequest"]): Promise<Approval> {
  return runnerAt(runner).post("/api/approvals", { body });
}

/** Check what prevents a start, for each engine. Nothing is sent to a robot but a get. */
export function runPreflight(
  runner: string,
  what: { graph: string; umrf: string } & Inside,
  engines: readonly string[],
  behaviours: boolean,
  led: LedOrder | null,
  said: { watching: Watching; drill: boolean; breakpoints: readonly RunBreakpoint[] },
  signal: AbortSignal,
): Promise<Preflight[]> {
  const breakpoints = [...said.breakpoints] as RunnerApi["Breakpoint"][];
  const way = { ...(behaviours ? { behaviours } : {}), ...led };
  const body = { engines, ...way, ...said, breakpoints, ...what };
  return runnerAt(runner).post("/api/preflight", { body, signal });
}

/** State of the index folder as the runner sees it, and the files that could be written there. */
export type IndexFolderLook = RunnerApi["IndexFolderState"];

/** Has graphs inside of a task written there. */
export function writeIntoIndex(
  runner: string,
  robot: string,
  body: RunnerApi["IndexWriteRequest"],
): Promise<RunnerApi["IndexWriteAnswer"]> {
  const request = { path: { name: robot }, body, timeoutMs: 30_000 };
  return runnerAt(runner).post("/api/robots/{name}/index", request);
}
