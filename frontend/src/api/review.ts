/** Requests about past runs: marks, comparisons, statistics, files, and the replay of a run. */
import { useQuery } from "@tanstack/react-query";
import { runnerAt, runnerOnlyAt } from "./client";
import { fetchAnswer, type RequestOptions } from "./http";
import { getRun } from "./run-stop";
import type { Inside, Run } from "./runs";
import type { RunnerApi } from "./schema/runner";
import { runnerOfRun } from "./site-places";

export type RunMarks = RunnerApi["RunMarks"];
/** A run of the list, with what people noted about it and why it did not end well. */
export type ListedRun = RunnerApi["Listed"];
/** Proven cause of the end of a run, with the place that shows it. */
export type Cause = RunnerApi["CauseShown"];
export type ComparedField = RunnerApi["Field"];
export type ComparedStep = RunnerApi["ComparedVisit"];
export type Comparison = RunnerApi["RunComparison"];
export type ActionStatistics = RunnerApi["ActionStatistics"];
export type Statistics = RunnerApi["Statistics"];

/** Filter of a list of runs; empty fields match all. */
export interface RunFilter {
  text: string;
  graph: string;
  robot: string;
  state: string;
  /** `true`: what went wrong; `false`: what did not. */
  failed: string;
  person: string;
  label: string;
  version: string;
  pinned: boolean;
  since: string;
  until: string;
}

export const NO_FILTER: RunFilter = {
  text: "",
  graph: "",
  robot: "",
  state: "",
  failed: "",
  person: "",
  label: "",
  version: "",
  pinned: false,
  since: "",
  until: "",
};

/** The filter as a query; empty parts are left out. */
export function queryOf(filter: RunFilter): URLSearchParams {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(filter)) {
    if (value !== "" && value !== false) query.set(name, String(value));
  }
  return query;
}

/** The filter in a query; what it does not know is ignored. */
export function filterOf(query: URLSearchParams): RunFilter {
  const text = (name: keyof RunFilter) => query.get(name) ?? "";
  return {
    text: text("text"),
    graph: text("graph"),
    robot: text("robot"),
    state: text("state"),
    failed: text("failed"),
    person: text("person"),
    label: text("label"),
    version: text("version"),
    pinned: query.get("pinned") === "true",
    since: text("since"),
    until: text("until"),
  };
}

const path = (run: string) => `/api/runs/${encodeURIComponent(run)}`;

export function listRuns(
  runner: string,
  filter: RunFilter,
  before: string | null,
  limit: number,
  signal?: AbortSignal,
): Promise<ListedRun[]> {
  return runnerAt(runner).get("/api/runs", { query: pageOf(filter, before, limit), signal });
}

function pageOf(filter: RunFilter, before: string | null, limit: number): URLSearchParams {
  const query = queryOf(filter);
  query.set("limit", String(limit));
  if (before !== null) query.set("before", before);
  return query;
}

/** Return the newest runs of a graph, or those before `before`, at the runner of a run, which compares no others. */
export function listComparable(
  runner: string,
  run: string,
  graph: string,
  before: string | null,
  limit: number,
  signal: AbortSignal,
): Promise<ListedRun[]> {
  const query = pageOf({ ...NO_FILTER, graph }, before, limit);
  return runnerOnlyAt(runnerOfRun(runner, run)).get("/api/runs", { query, signal });
}

/** Asks for the causes of the end of a run that needs an explanation, again when its state changes. */
export function useCauses(runner: string | undefined, run: Run) {
  return useQuery({
    queryKey: ["runs", "causes", run.id, run.state, run.alarms.length],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/runs/{run}/causes", { path: { run: run.id }, signal }),
    enabled: runner !== undefined && needsExplanation(run),
  });
}

/** Return whether the end of a run needs an explanation. */
export function needsExplanation(run: Run): boolean {
  if (run.state === "finished") return run.result !== "on_true";
  return run.ended_at !== null || run.state === "unknown" || run.alarms.length > 0;
}

/** Import the recorded runs that the product brings along. Returns their ids. */
export function importExamples(runner: string): Promise<string[]> {
  return runnerAt(runner).post("/api/examples", {});
}

export function useMarks(runner: string | undefined, run: string) {
  return useQuery({
    queryKey: ["runs", "marks", run],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/runs/{run}/marks", { path: { run }, signal }),
    enabled: runner !== undefined,
  });
}

export function setMarks(runner: string, run: string, marks: Partial<RunMarks>): Promise<RunMarks> {
  const request = { path: { run }, body: marks, keepalive: true };
  return runnerAt(runner).patch("/api/runs/{run}/marks", request);
}

export function useLabels(runner: string | undefined) {
  return useQuery({
    queryKey: ["runs", "labels"],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/labels", { signal }),
    enabled: runner !== undefined,
  });
}

export function useComparison(runner: string | undefined, a: string, b: string) {
  return useQuery({
    queryKey: ["runs", "comparison", a, b],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/comparison", { query: { a, b }, signal }),
    enabled: runner !== undefined && a !== "" && b !== "",
  });
}

export function useStatistics(runner: string | undefined, graph: string) {
  return useQuery({
    queryKey: ["runs", "statistics", runner, graph],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/statistics", { query: { graph }, signal }),
    enabled: runner !== undefined && graph !== "",
  });
}

export type InjectedFault = NonNullable<RunnerApi["ScriptRequest"]["fault"]>;

/**
 * Return a script for the simulator that repeats a run; with `fault` one action fails at its last
 * visit.
 */
export function recordedScriptOf(
  runner: string,
  run: string,
  fault?: { action: string; fault: InjectedFault },
): Promise<RunnerApi["Recorded"]> {
  return runnerAt(runner).get("/api/runs/{run}/script", { path: { run }, query: { ...fault } });
}

/** Return such a script for another version of the graph; `umrf` is JSON text. */
export function recordedScriptFor(
  runner: string,
  run: string,
  umrf: string,
  subgraphs: Inside["subgraphs"],
  fault?: { action: string; fault: InjectedFault },
): Promise<RunnerApi["Recorded"]> {
  const body = { ...fault, umrf, ...(subgraphs && { subgraphs }) };
  return runnerAt(runner).post("/api/runs/{run}/script", { path: { run }, body });
}

/** Runs that one request has started together with this one. */
export function useRunsOfSameStart(runner: string | undefined, run: Run) {
  const around = (ms: number) => new Date(Date.parse(run.requested_at) + ms).toISOString();
  return useQuery({
    queryKey: ["runs", "mates", run.id],
    queryFn: async ({ signal }) => {
      const query = { since: around(-10_000), until: around(10_000) };
      const near = await runnerAt(runner).get("/api/runs", { query, signal });
      const ids = near.filter((each) => each.group === run.group && each.id !== run.id);
      return Promise.all(ids.map((each) => getRun(runner ?? "", each.id, signal)));
    },
    enabled: runner !== undefined && run.group !== null,
  });
}

/**
 * Query where the raw messages from the time of a run are. `text` is empty if all of them are here.
 */
export function useRaw(runner: string | undefined, run: Run) {
  return useQuery({
    queryKey: ["runs", "raw", run.id],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/runs/{run}/raw", { path: { run: run.id }, signal }),
    enabled: runner !== undefined && !run.simulated,
  });
}

/** Return the address from which a run can be downloaded as a file. */
export function exportUrl(runner: string, run: string, format: "jsonl" | "csv" | "mcap"): string {
  return `${runnerOfRun(runner, run)}${path(run)}/export?format=${format}`;
}

/** The first `most` lines of what a route answers, and whether there are more. */
async function fetchLines(
  url: string,
  most: number,
  request: RequestOptions = {},
): Promise<{ lines: string[]; more: boolean }> {
  const response = await fetchAnswer(url, request);
  const reader = response.body?.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const part = await reader?.read();
    if (part === undefined || part.done) break;
    text += part.value;
    if (text.split("\n").length > most + 1) break;
  }
  await reader?.cancel();
  const lines = text.split("\n").filter((line) => line !== "");
  return { lines: lines.slice(0, most), more: lines.length > most };
}

/** The first stored events of a run, each as one line of JSON. */
export function useRawEvents(runner: string | undefined, run: Run, most: number) {
  return useQuery({
    queryKey: ["runs", "raw", run.id, run.state, most],
    queryFn: ({ signal }) =>
      fetchLines(exportUrl(runner ?? "", run.id, "jsonl"), most, { signal, timeoutMs: 30_000 }),
    enabled: runner !== undefined,
  });
}

/** Return the address of the graph of a run, as it was sent. */
export function umrfUrl(runner: string, run: string): string {
  return `${runnerOfRun(runner, run)}${path(run)}/umrf`;
}

/** Changes of an action. From the visit number `first` on, its visits are now `visits`. */
export type ActionFrame = RunnerApi["ActionFrame"];
/** One event: the fields of the run and the actions that it changed. */
export type Frame = RunnerApi["ReplayFrame"];
/** Event around the actions: a request of a person, a message sent, a silence, a proof. */
export type ReplayMark = RunnerApi["MarkShown"];
/** A page of a run's replay: `base` after `after` events, then the frames of the next ones. */
export type Replay = RunnerApi["RunReplay"];

export function useReplayData(
  runner: string | undefined,
  run: string,
  after: number,
  asked: boolean,
) {
  return useQuery({
    queryKey: ["runs", "film", run, after],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/runs/{run}/film", {
        path: { run },
        query: { after },
        signal,
        timeoutMs: 60_000,
      }),
    enabled: asked && runner !== undefined,
  });
}
