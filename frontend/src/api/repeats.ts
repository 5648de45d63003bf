/** Repeats: one start, carried out several times or over a grid of values. */
import { useQuery } from "@tanstack/react-query";
import { serverNow } from "../clock/server-clock";
import { runnerAt } from "./client";
import { type Run, type StartOrder, startBody, type Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";
import { runnerOfRun } from "./site-places";

export type Repeat = RunnerApi["RepeatShown"];
export type RepeatSummary = RunnerApi["RepeatSummary"];
export type Axis = RunnerApi["Axis"];

/** Number of times that a start is carried out, and its values. */
export interface RepeatOrder {
  readonly times: number;
  readonly grid: readonly Axis[];
  readonly seed: number | null;
  /** In the simulator alone: the next run starts when the one before has ended true. */
  readonly by_itself: boolean;
}

const POLL = 1_000; // ms
const LOOK_AGAIN = 5_000; // ms
const SUMMED_WITHIN = 15_000; // ms after its end a run has its sums

/** Return whether the times of a run that has just ended are still to come. */
function isSummedSoon({ cells }: Repeat): boolean {
  return cells.some(
    ({ run }) =>
      run?.ended_at && !run.took && serverNow() - Date.parse(run.ended_at) < SUMMED_WITHIN,
  );
}

/** Open a repeat. On robots nothing starts by that. */
export async function openRepeat(order: StartOrder, repeat: RepeatOrder): Promise<Repeat> {
  const [engine = ""] = order.engines;
  const start = { ...(await startBody(order)), engine };
  const body = { ...repeat, start } as RunnerApi["RepeatRequest"];
  return runnerAt(order.runner).post("/api/repeats", { body });
}

/** Query a repeat, again and again while it is open or a run of it goes on. */
export function useRepeat(runner: string | undefined, id: string) {
  return useQuery({
    queryKey: ["repeats", id],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/repeats/{repeat}", { path: { repeat: id }, signal }),
    enabled: runner !== undefined,
    refetchInterval: ({ state }) =>
      state.data?.state === "closed" && !isSummedSoon(state.data) ? false : POLL,
  });
}

export function useRepeats(runner: string | undefined) {
  return useQuery({
    queryKey: ["repeats"],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/repeats", { query: {}, signal }),
    enabled: runner !== undefined,
  });
}

/** Query what a look before the next run of a repeat finds, again and again: a yes may come. */
export function useCellLook(
  runner: string,
  { id, next }: Pick<Repeat, "id" | "next">,
  on: boolean,
) {
  return useQuery({
    queryKey: ["repeat-look", id, next],
    queryFn: () => {
      const body = { watching: {} };
      return runnerAt(runner).post("/api/repeats/{repeat}/look", { path: { repeat: id }, body });
    },
    enabled: on,
    refetchInterval: LOOK_AGAIN,
    gcTime: 0,
    staleTime: 0,
    retry: false,
  });
}

/** Say that everything is set back, and start the cell. */
export function startCell(
  runner: string,
  repeat: string,
  cell: number,
  watching: Watching,
): Promise<Run> {
  const path = { repeat };
  return runnerAt(runner).post("/api/repeats/{repeat}/start", { path, body: { cell, watching } });
}

/** Stop repeating; a run that goes on is not stopped. */
export function closeRepeat(runner: string, repeat: string): Promise<Repeat> {
  return runnerAt(runner).post("/api/repeats/{repeat}/close", { path: { repeat } });
}

/** Open a closed repeat again after a look. */
export function reopenRepeat(
  runner: string,
  { id, closings }: Pick<Repeat, "id" | "closings">,
  watching: Watching,
): Promise<Repeat> {
  const path = { repeat: id };
  return runnerAt(runner).post("/api/repeats/{repeat}/open", {
    path,
    body: { closings, watching },
  });
}

/** Return the address of the table as a file. */
export function tableUrl(runner: string, repeat: string, format: "csv" | "parquet"): string {
  return `${runnerOfRun(runner, repeat)}/api/repeats/${encodeURIComponent(repeat)}/table?format=${format}`;
}
