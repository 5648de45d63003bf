/** Expected courses of a graph, what they cover, and tests that would cover more. */
import { keepPreviousData, type QueryClient, useQuery } from "@tanstack/react-query";
import { runnerAt } from "./client";
import type { Script } from "./dry-runs";
import { fetchText } from "./http";
import { fetchInside } from "./inside";
import { useLive } from "./page-link";
import type { Inside } from "./runs";
import type { RunnerApi } from "./schema/runner";

export type CheckedCourses = RunnerApi["CheckedCourses"];
export type CheckedCourse = RunnerApi["CheckedCourse"];
/** One outcome of an arrow; parent and child are keys of actions, or `entry` and `exit`. */
export type OutcomeArrow = RunnerApi["OutcomeArrow"];
export type ArrowProposal = RunnerApi["ArrowProposal"];

const COURSES = "courses";
const LONG = 60_000; // ms: many courses are simulated

/** The text of a moment with the identities of its actions, by which courses know renamed ones. */
export function identifiedText(graph: string, seq: number, signal?: AbortSignal): Promise<string> {
  const route = `/api/graphs/${encodeURIComponent(graph)}/umrf?at=${seq}&identities=true`;
  return fetchText(route, { ...(signal && { signal }) });
}

/** The expected courses of a graph held against a text of it. */
function checkCourses(
  runner: string,
  graph: string,
  umrf: string,
  signal: AbortSignal,
  inside: Inside = {},
): Promise<CheckedCourses> {
  const body = { graph, umrf, ...(inside.subgraphs && { subgraphs: inside.subgraphs }) };
  return runnerAt(runner).post("/api/expectations/check", { body, signal, timeoutMs: LONG });
}

/** Query the results for a text that is no moment of the graph yet; `of` is its cache key. */
export function useCoursesOfText(graph: string, umrf: string, of: readonly unknown[]) {
  const { runner } = useLive();
  return useQuery({
    queryKey: [COURSES, graph, "text", ...of],
    queryFn: ({ signal }) => checkCourses(runner ?? "", graph, umrf, signal),
    enabled: runner !== undefined,
    placeholderData: keepPreviousData,
    staleTime: 30_000,
  });
}

/** The expected courses held against a moment; the last answer stays until the next. */
export function useCheckedCourses(graph: string, seq: number) {
  const { runner } = useLive();
  return useQuery({
    queryKey: [COURSES, graph, seq],
    queryFn: async ({ signal }) => {
      const umrf = await identifiedText(graph, seq, signal);
      const inside = await fetchInside(graph, seq, signal);
      return checkCourses(runner ?? "", graph, umrf, signal, inside);
    },
    enabled: runner !== undefined && seq > 0,
    placeholderData: keepPreviousData,
    staleTime: 30_000,
  });
}

export function refreshCourses(client: QueryClient): Promise<void> {
  return client.invalidateQueries({ queryKey: [COURSES] });
}

/** Ask how actions would have to end for the arrow to be taken, if that is possible. */
export async function proposeCourse(
  runner: string,
  graph: string,
  seq: number,
  arrow: OutcomeArrow,
): Promise<ArrowProposal> {
  const umrf = await identifiedText(graph, seq);
  const { subgraphs } = await fetchInside(graph, seq);
  const body = { umrf, arrow, ...(subgraphs && { subgraphs }) };
  return runnerAt(runner).post("/api/expectations/proposal", { body, timeoutMs: LONG });
}

/** Keeps what a moment does under a script as what is expected of it from now on. */
export async function expectDryRun(
  runner: string,
  of: { graph: string; seq: number; script: Script },
  name: string,
): Promise<void> {
  const { graph, seq, script } = of;
  const umrf = await identifiedText(graph, seq);
  const { subgraphs } = await fetchInside(graph, seq);
  const body = { name, graph, umrf, script, ...(subgraphs && { subgraphs }) };
  await runnerAt(runner).post("/api/expectations", { body, timeoutMs: LONG });
}

export function expectRun(runner: string, run: string, name: string): Promise<unknown> {
  return runnerAt(runner).post("/api/expectations", { body: { run, name } });
}

export function dropCourse(runner: string, name: string): Promise<unknown> {
  return runnerAt(runner).delete("/api/expectations/{name}", { path: { name } });
}
