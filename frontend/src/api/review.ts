/** What the runner tells of past runs: replays, marks, comparisons, statistics, files. */
import { useQuery } from "@tanstack/react-query";
import { fetchJson, fetchLines } from "./http";
import { type ActionRun, type DurationBounds, getRun, type Run, type Visit } from "./runs";

/** What became of an action. From the visit number `first` on, its visits are now `visits`. */
export interface ActionFrame {
  state: string;
  first: number;
  visits?: Visit[];
  messages?: ActionRun["messages"];
  aid?: string;
}

/** One event: the fields of the run and the actions that it changed. */
export interface Frame {
  seq: number;
  at: string;
  kind: string;
  by?: string;
  text?: string;
  head?: Partial<Run>;
  actions?: Record<string, ActionFrame>;
  alarms?: Run["alarms"];
}

/** Something that happened around the actions: a wish, a message sent, a silence, a proof. */
export interface ReplayMark {
  seq: number;
  at: string;
  kind: string;
  by?: string;
  text?: string;
  since?: string;
}

/** A page of a run's replay: `base` after `after` events, then the frames of the next ones. */
export interface Replay {
  run: string;
  after: number;
  newest: number;
  base: Run | null;
  frames: Frame[];
  chapters: { after: number; at: string }[];
  marks: ReplayMark[];
}

export interface RunMarks {
  pinned: boolean;
  note: string;
  labels: string[];
}

/** A run of the list, with what people noted about it and why it did not end well. */
export type ListedRun = Run & Partial<RunMarks> & { cause?: string };

/** What is proven to be behind the end of a run, and where that shows. */
export interface Cause {
  kind: string;
  text: string;
  at: string;
  seq: number;
  action: string | null;
  aid: string | null;
  quote: string;
}

export interface ComparedField {
  field: string;
  before: unknown;
  after: unknown;
}

interface ComparedChange {
  change: "added" | "removed" | "changed";
  fields: ComparedField[];
}

export interface ComparedStep {
  action: string;
  aid: string | null;
  visit: number;
  a: Visit | null;
  b: Visit | null;
  relation: "same" | "result" | "only_a" | "only_b" | "unknown" | "end";
  slower: "a" | "b" | null;
}

export interface Comparison {
  a: Run;
  b: Run;
  same_graph: boolean;
  same_engine: boolean;
  graph: {
    fields: ComparedField[];
    actions: (ComparedChange & { aid: string; name: string })[];
    relations: (ComparedChange & { parent: string; child: string })[];
  };
  steps: ComparedStep[];
  left_out: number;
  parting: { step: ComparedStep; text: string; messages_a: string[]; messages_b: string[] } | null;
  text: string;
}

export interface ActionStatistics {
  action: string;
  aid: string | null;
  runs: number;
  visits: number;
  results: Partial<Record<"true" | "false" | "error" | "stopped", number>>;
  unknown: number;
  inferred: number;
  timed: number;
  p50: number | null;
  p90: number | null;
  p99: number | null;
  longest: number | null;
  spans: Record<"p50" | "p90" | "p99" | "longest", DurationBounds | null>;
}

export interface Statistics {
  runs: {
    id: string;
    number: number;
    state: Run["state"];
    result: Run["result"];
    took: number | null;
    span: DurationBounds | null;
  }[];
  judged: number;
  succeeded: number;
  unknown: number;
  actions: ActionStatistics[];
  never_taken: { parent: string; child: string; outcomes: string[] }[];
  untold: number;
}

/** Which runs a list shows; what is empty asks for all. */
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
  const query = queryOf(filter);
  query.set("limit", String(limit));
  if (before !== null) query.set("before", before);
  return fetchJson(`${runner}/api/runs?${query}`, signal ? { signal } : {});
}

export function useReplayData(
  runner: string | undefined,
  run: string,
  after: number,
  asked: boolean,
) {
  return useQuery({
    queryKey: ["runs", "film", run, after],
    queryFn: ({ signal }) =>
      fetchJson<Replay>(`${runner}${path(run)}/film?after=${after}`, { signal, timeoutMs: 60_000 }),
    enabled: asked && runner !== undefined,
  });
}

/** Asked again when the run changes its state. */
export function useCauses(runner: string | undefined, run: Run) {
  return useQuery({
    queryKey: ["runs", "causes", run.id, run.state, run.alarms.length],
    queryFn: ({ signal }) => fetchJson<Cause[]>(`${runner}${path(run.id)}/causes`, { signal }),
    enabled: runner !== undefined && needsExplanation(run),
  });
}

/** Whether there is something to explain. */
export function needsExplanation(run: Run): boolean {
  if (run.state === "finished") return run.result !== "on_true";
  return run.ended_at !== null || run.state === "unknown" || run.alarms.length > 0;
}

/** Takes in the recorded runs that the product brings along; their ids. */
export function importExamples(runner: string): Promise<string[]> {
  return fetchJson(`${runner}/api/examples`, { method: "POST", body: {} });
}

export function useMarks(runner: string | undefined, run: string) {
  return useQuery({
    queryKey: ["runs", "marks", run],
    queryFn: ({ signal }) => fetchJson<RunMarks>(`${runner}${path(run)}/marks`, { signal }),
    enabled: runner !== undefined,
  });
}

export function setMarks(runner: string, run: string, marks: Partial<RunMarks>): Promise<RunMarks> {
  return fetchJson(`${runner}${path(run)}/marks`, { method: "PATCH", body: marks });
}

export function useLabels(runner: string | undefined) {
  return useQuery({
    queryKey: ["runs", "labels"],
    queryFn: ({ signal }) => fetchJson<string[]>(`${runner}/api/labels`, { signal }),
    enabled: runner !== undefined,
  });
}

export function useComparison(runner: string | undefined, a: string, b: string) {
  return useQuery({
    queryKey: ["runs", "comparison", a, b],
    queryFn: ({ signal }) =>
      fetchJson<Comparison>(`${runner}/api/comparison?${new URLSearchParams({ a, b })}`, {
        signal,
      }),
    enabled: runner !== undefined && a !== "" && b !== "",
  });
}

export function useStatistics(runner: string | undefined, graph: string) {
  return useQuery({
    queryKey: ["runs", "statistics", graph],
    queryFn: ({ signal }) =>
      fetchJson<Statistics>(`${runner}/api/statistics?${new URLSearchParams({ graph })}`, {
        signal,
      }),
    enabled: runner !== undefined && graph !== "",
  });
}

export type InjectedFault = "error" | "false" | "hang" | "init_error";

/** What a run did, as a script for the simulator; with `fault` one action fails at its last visit. */
export function recordedScriptOf(
  runner: string,
  run: string,
  fault?: { action: string; fault: InjectedFault },
): Promise<{ behaviours: unknown; doubts: { action: string; text: string }[] }> {
  const query = fault ? `?${new URLSearchParams({ ...fault })}` : "";
  return fetchJson(`${runner}${path(run)}/script${query}`);
}

/** The same for another version of the graph; `umrf` is JSON text. */
export function recordedScriptFor(
  runner: string,
  run: string,
  umrf: string,
  fault?: { action: string; fault: InjectedFault },
): Promise<{ behaviours: unknown; doubts: { action: string; text: string }[] }> {
  const head = JSON.stringify({ ...fault });
  const body = `${head.slice(0, -1)}${fault ? "," : ""}"umrf":${umrf}}`;
  return fetchJson(`${runner}${path(run)}/script`, { method: "POST", body });
}

/** Runs that one request has started together with this one. */
export function useRunsOfSameStart(runner: string | undefined, run: Run) {
  const around = (ms: number) => new Date(Date.parse(run.requested_at) + ms).toISOString();
  return useQuery({
    queryKey: ["runs", "mates", run.id],
    queryFn: async ({ signal }) => {
      const query = new URLSearchParams({ since: around(-10_000), until: around(10_000) });
      const near = await fetchJson<Run[]>(`${runner}/api/runs?${query}`, { signal });
      const ids = near.filter((each) => each.group === run.group && each.id !== run.id);
      return Promise.all(ids.map((each) => getRun(runner ?? "", each.id, signal)));
    },
    enabled: runner !== undefined && run.group !== null,
  });
}

/** Where the raw messages from the time of a run are. `text` is empty when all of them are here. */
export function useRaw(runner: string | undefined, run: Run) {
  return useQuery({
    queryKey: ["runs", "raw", run.id],
    queryFn: ({ signal }) =>
      fetchJson<{ text: string; hours: { name: string }[] }>(`${runner}/api/runs/${run.id}/raw`, {
        signal,
      }),
    enabled: runner !== undefined && !run.simulated,
  });
}

export function expectRun(runner: string, run: string, name: string): Promise<unknown> {
  return fetchJson(`${runner}/api/expectations`, { method: "POST", body: { run, name } });
}

/** Where a run can be fetched as a file. */
export function exportUrl(runner: string, run: string, format: "jsonl" | "csv" | "mcap"): string {
  return `${runner}${path(run)}/export?format=${format}`;
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

/** Where the graph of a run is, as it was sent. */
export function umrfUrl(runner: string, run: string): string {
  return `${runner}${path(run)}/umrf`;
}
