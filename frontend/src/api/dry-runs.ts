/** Dry-runs: what a graph would do by the engine's rules. Nothing is recorded. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { editor } from "./client";
import type { EditorApi } from "./schema/editor";

type DryRunResult = EditorApi["Rehearsal"];
/** One line of a trace, as `simulate --trace` prints it. */
export type TraceEvent = DryRunResult["trace"][number];
export type Behaviour = EditorApi["Behaviour"];
export type Script = EditorApi["Script"];
export type Command = EditorApi["Command"];
/** The actions with which a dry-run begins, if not at the entry; `only`: it plays nothing else. */
export type DryRunPart = EditorApi["RehearsedPart"];
export type DryRunRequest = Required<
  Pick<EditorApi["Rehearsing"], "script" | "commands" | "values">
> & {
  seq: number;
  from?: DryRunPart;
};

/** Plays the moment `seq`; null while nobody wants to see it. The last answer stays until the next. */
export function useDryRunResult(graph: string, wanted: DryRunRequest | null) {
  return useQuery({
    queryKey: ["rehearsal", graph, wanted],
    queryFn: ({ signal }) =>
      editor.post("/api/graphs/{graph_id}/rehearsal", {
        path: { graph_id: graph },
        body: wanted ?? {},
        signal,
      }),
    enabled: wanted !== null && wanted.seq > 0,
    placeholderData: keepPreviousData,
    staleTime: 5_000, // graphs inside of it may have changed
    gcTime: 60_000,
  });
}
