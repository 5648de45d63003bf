/**
 * Requests about the history of a document: entries, differences, earlier moments, restoring them.
 */
import { type QueryClient, useQuery } from "@tanstack/react-query";
import { editor, runnerAt } from "./client";
import type { GraphSummary } from "./graphs";
import { recordedScriptOf } from "./review";
import type { Run } from "./runs";
import type { EditorApi } from "./schema/editor";
import { type AgedRun, newerFirst } from "./sites";

export type HistoryEntry = EditorApi["HistoryEntry"];

const inGraph = (id: string) => ({ graph_id: id });

/** Query the newest entries of the history of a graph, newest first, anew for each `seq`, the moment on screen. */
export function useHistory(id: string, seq: number) {
  return useQuery({
    queryKey: ["history", id, seq],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/{graph_id}/history", { path: inGraph(id), signal }),
    placeholderData: (before) => before,
  });
}

/** A page of it, newest first: what was before a change, or the newest. */
export function fetchHistory(
  id: string,
  limit: number,
  before: number | null,
  signal?: AbortSignal,
): Promise<HistoryEntry[]> {
  const query = { limit, before: before ?? undefined };
  return editor.get("/api/graphs/{graph_id}/history", { path: inGraph(id), query, signal });
}

/** The root maps of the document as they were after a change. */
export function fetchDocument(
  id: string,
  at: number,
  signal?: AbortSignal,
): Promise<EditorApi["PastDocument"]> {
  return editor.get("/api/graphs/{graph_id}/document", {
    path: inGraph(id),
    query: { at },
    signal,
  });
}

/** The steps from one moment to another, key by key, in order of time. */
export function fetchChanges(
  id: string,
  after: number,
  upto: number,
  signal: AbortSignal,
): Promise<EditorApi["DocumentStep"][]> {
  const query = { after, upto };
  return editor.get("/api/graphs/{graph_id}/changes", { path: inGraph(id), query, signal });
}

/** Query the differences from change `from` to change `to`; null as `from` disables the query. */
export function useDifference(id: string, from: number | null, to: number) {
  return useQuery({
    enabled: from !== null,
    queryKey: ["history", id, "difference", from, to],
    queryFn: ({ signal }) => {
      const query = { from: from ?? 0, to };
      return editor.get("/api/graphs/{graph_id}/diff", { path: inGraph(id), query, signal });
    },
    staleTime: Number.POSITIVE_INFINITY,
  });
}

export type FieldBlame = EditorApi["FieldBlame"];
export type FieldValue = EditorApi["FieldValue"];

/**
 * Query who gave each field of an action, arrow or note, or of the graph (""), its value at a
 * moment; without `at`, now, and each time anew.
 */
export function useBlame(id: string, of: string, at?: number) {
  return useQuery({
    enabled: at !== 0,
    queryKey: ["history", id, "blame", of, at ?? "now"],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/{graph_id}/blame", { path: inGraph(id), query: { of, at }, signal }),
    retry: false,
  });
}

/** All values that a field has had until then, newest first. */
export function useFieldValues(id: string, of: string, field: string, at: number) {
  const query = { of, field, at };
  return useQuery({
    queryKey: ["history", id, "values", of, field, at],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/{graph_id}/blame/values", { path: inGraph(id), query, signal }),
  });
}

/** Makes it what it was after an earlier change, or one thing of it, by its key: an edit, which everybody sees. */
export function restoreMoment(id: string, seq: number, of?: string): Promise<GraphSummary> {
  const body = of === undefined ? { seq } : { seq, of };
  return editor.post("/api/graphs/{graph_id}/restore", { path: inGraph(id), body });
}

/** Takes back what one person did, where nobody has changed it since. */
export function revertEdits(
  id: string,
  body: EditorApi["EditsOfOne"],
): Promise<EditorApi["GoneBack"]> {
  return editor.post("/api/graphs/{graph_id}/revert", { path: inGraph(id), body });
}

/**
 * Reads again what is on screen. An edit of ours is shown before what it was is written down: what is being read
 * may be from between, and is given up, since the library would keep the first answer of a moment.
 */
export async function refreshHistory(client: QueryClient, id: string): Promise<void> {
  const all = { queryKey: ["history", id] };
  await client.cancelQueries(all);
  await client.invalidateQueries(all);
}

export type SinceWhen = EditorApi["SinceWhen"];

/**
 * A question and its answer; `good` is null if no earlier run went well, so that there is nothing
 * to ask.
 */
export interface SinceAnswer {
  readonly good: Run | null;
  readonly found: SinceWhen | null;
}

type Outcome = Pick<Run, "version" | "state" | "result">;
type Ended = AgedRun & Outcome;

/** Return whether a run of a version ended as wanted. */
export function wentWell({ version, state, result }: Outcome): boolean {
  return version !== null && state === "finished" && (result === "on_true" || result === null);
}

/** The last run, before one, that went well, as far as it is known. */
export function lastGoodRun<R extends Ended>(runs: readonly R[], before?: AgedRun): R | null {
  const isBefore = (each: R) => before === undefined || newerFirst(before, each) < 0;
  return runs.filter((each) => isBefore(each) && wentWell(each)).sort(newerFirst)[0] ?? null;
}

async function asked(runner: string, run: Run, graph: string): Promise<SinceAnswer> {
  const path = inGraph(graph);
  const [runs, versions] = await Promise.all([
    runnerAt(runner).get("/api/runs", { query: { limit: 1000, graph } }),
    editor.get("/api/graphs/{graph_id}/versions", { path }),
  ]);
  const seqOf = (of: Run) => versions.find(({ id }) => id === of.version)?.seq;
  const good = lastGoodRun(runs, run);
  const [from, to] = [good === null ? undefined : seqOf(good), seqOf(run)];
  if (good === null || from === undefined || to === undefined || from > to) {
    return { good: null, found: null };
  }
  const { behaviours } = await recordedScriptOf(runner, run.id);
  const body = { good: from, bad: to, script: { behaviours } };
  return { good, found: await editor.post("/api/graphs/{graph_id}/since", { path, body }) };
}

/** Asks once, when it is `wanted`, which changes after the last good run altered the course of the graph. */
export function useSince(runner: string | undefined, run: Run, wanted: boolean) {
  const { graph } = run;
  return useQuery({
    queryKey: ["runs", "since", run.id],
    queryFn: () => asked(runner ?? "", run, graph ?? ""),
    enabled: wanted && runner !== undefined && graph !== null,
    staleTime: Number.POSITIVE_INFINITY,
    retry: false,
  });
}
