/** The replay of a run: what every event of it changed, a page at a time. */
import { useQuery } from "@tanstack/react-query";
import { runnerAt } from "./client";
import type { RunnerApi } from "./schema/runner";

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
