/** Dry-runs: what a graph would do by the engine's rules. Nothing is recorded. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { fetchJson } from "./http";

interface At {
  readonly t_ms: number;
  readonly graph: string;
}

/** One line of a trace, as `simulate --trace` prints it. */
export type TraceEvent = At &
  (
    | { readonly kind: "node_state"; readonly node: string; readonly state: string }
    | { readonly kind: "graph_state"; readonly state: string }
    | { readonly kind: "edge"; readonly edge: string; readonly eval: string }
    | { readonly kind: "dispatch"; readonly node: string; readonly response: string }
    | { readonly kind: "not_ready"; readonly node: string; readonly why: string }
    | { readonly kind: "graph_result"; readonly value: string }
    | {
        readonly kind: "node_result";
        readonly node: string;
        readonly result: string;
        readonly message?: string;
      }
    | {
        readonly kind: "hazard";
        readonly code: string;
        readonly effect: string;
        readonly node?: string | null;
        readonly message?: string;
      }
  );

export interface Behaviour {
  readonly after_s?: number;
  readonly result?: "on_true" | "on_false" | "on_error";
  readonly never?: boolean;
  readonly init_error?: boolean;
  readonly ignores_stop?: boolean;
  readonly message?: string;
}

export interface Script {
  readonly behaviours: Readonly<Record<string, readonly Behaviour[]>>;
}

export interface Command {
  readonly at_ms: number;
  readonly verb: "stop" | "pause" | "resume";
}

export interface DryRunResult {
  readonly seq: number;
  readonly trace: readonly TraceEvent[];
  /** There is more than is told. */
  readonly cut: boolean;
}

export interface DryRunRequest {
  readonly seq: number;
  readonly script: Script;
  readonly commands: readonly Command[];
}

/** Plays the moment `seq`; null while nobody wants to see it. The last answer stays until the next. */
export function useDryRunResult(graph: string, wanted: DryRunRequest | null) {
  return useQuery({
    queryKey: ["rehearsal", graph, wanted],
    queryFn: ({ signal }) =>
      fetchJson<DryRunResult>(`/api/graphs/${encodeURIComponent(graph)}/rehearsal`, {
        method: "POST",
        body: wanted,
        signal,
      }),
    enabled: wanted !== null && wanted.seq > 0,
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 60_000,
  });
}
