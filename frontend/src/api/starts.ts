/** Before a start: what is looked at, and who has said yes. */
import { useQuery } from "@tanstack/react-query";
import type { RunBreakpoint } from "../graph/breakpoints";
import { editor, runnerAt } from "./client";
import type { LedOrder } from "./led-runs";
import { useLive } from "./page-link";
import { usePerson } from "./people";
import type { Preflight } from "./robots";
import type { Inside, Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";

export type Approval = RunnerApi["Approval"];
/** An input for which a start asks. */
export type AskedInput = RunnerApi["AskedInput"];
/** Values of a start, by the full name of the action and the flat name of the input. */
export type StartValues = RunnerApi["ApprovalWanted"]["values"];
/** The place where a start begins, if not at the entry. */
export type StartFrom = RunnerApi["StartFrom"];
/** All that a start takes for granted then. */
export type Earlier = RunnerApi["EarlierShown"];
export type StartValue = StartValues[string][string];
/** A person's question for the yes of others to a start. */
export type ApprovalWanted = RunnerApi["ApprovalWanted"];

/** Fetch for which inputs a start of a graph asks. */
export function fetchAskedInputs(
  runner: string,
  what: { graph: string; umrf: string; from?: StartFrom | undefined },
  signal: AbortSignal,
): Promise<AskedInput[]> {
  const { from, ...body } = what;
  return runnerAt(runner).post("/api/asked_inputs", {
    body: { ...body, ...(from && { from }) },
    signal,
  });
}

/** Values that a graph was started with before. */
export interface EarlierValues {
  readonly values: StartValues;
  /** The number of the run. */
  readonly run: number;
}

const LOOKED_THROUGH = 100; // runs of the graph, the newest

/** Query the values of the newest start of a graph, by this person if there is one. `asks`: it asks for some. */
export function useEarlierValues(graph: string, asks: boolean) {
  const { runner } = useLive();
  const { person } = usePerson();
  return useQuery({
    queryKey: ["runs", "values", graph, person.id],
    queryFn: ({ signal }) => fetchEarlierValues(runner ?? "", graph, person.id, signal),
    enabled: asks && runner !== undefined,
    staleTime: 0,
    gcTime: 0,
  });
}

/** Fetch the values with which the graph was last started by a person, or else by anybody; null for none. */
async function fetchEarlierValues(
  runner: string,
  graph: string,
  person: string,
  signal: AbortSignal,
): Promise<EarlierValues | null> {
  const query = { graph, limit: LOOKED_THROUGH };
  const runs = await runnerAt(runner).get("/api/runs", { query, signal });
  const known = runs.filter(({ values }) => values !== undefined);
  const found = known.find(({ author }) => author.id === person) ?? known[0];
  return found?.values ? { values: found.values, run: found.number } : null;
}

/** Fetch for which starts of a graph people asked others for their yes; the newest first. */
export function fetchWantedApprovals(
  runner: string,
  graph: string,
  signal: AbortSignal,
): Promise<ApprovalWanted[]> {
  return runnerAt(runner).get("/api/approvals/asked", { query: { graph }, signal });
}

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
  said: {
    watching: Watching;
    drill: boolean;
    breakpoints: readonly RunBreakpoint[];
    values: StartValues;
    from?: StartFrom;
  },
  signal: AbortSignal,
): Promise<Preflight[]> {
  const breakpoints = [...said.breakpoints] as RunnerApi["Breakpoint"][];
  const way = { ...(behaviours ? { behaviours } : {}), ...led };
  const body = { engines, ...way, ...said, breakpoints, ...what };
  return runnerAt(runner).post("/api/preflight", { body, signal });
}

/** State of the index folder as the runner sees it, and the files that could be written there. */
export type IndexFolderLook = RunnerApi["IndexFolderState"];

/** Have graphs inside of a task written into the folder in which the engine of a robot looks them up. */
export function writeIntoIndex(
  runner: string,
  robot: string,
  body: RunnerApi["IndexWriteRequest"],
): Promise<RunnerApi["IndexWriteAnswer"]> {
  const request = { path: { name: robot }, body, timeoutMs: 30_000 };
  return runnerAt(runner).post("/api/robots/{name}/index", request);
}
