/** Since which edit a graph goes another way: past moments simulated with what a run's actions did. */
import { useQuery } from "@tanstack/react-query";
import type { Version } from "../graphs";
import { fetchJson } from "../http";
import { recordedScriptOf } from "../review";
import type { Run } from "../runs";
import type { EditorApi } from "../schema/editor";

export type SinceWhen = EditorApi["SinceWhen"];

/** What was asked, and the answer; `good` null: no run before went well, so there is nothing to ask. */
export interface SinceAnswer {
  readonly good: Run | null;
  readonly found: SinceWhen | null;
}

type Ended = Pick<Run, "number" | "version" | "state" | "result">;

/** Whether a run of a version did what it was for. */
export function wentWell({ version, state, result }: Ended): boolean {
  return version !== null && state === "finished" && (result === "on_true" || result === null);
}

/** The last run, before one, that went well, as far as it is known. */
export function lastGoodRun<R extends Ended>(
  runs: readonly R[],
  before = Number.POSITIVE_INFINITY,
): R | null {
  const good = runs.filter((each) => each.number < before && wentWell(each));
  return good.reduce<R | null>(
    (last, each) => (last === null || each.number > last.number ? each : last),
    null,
  );
}

async function asked(runner: string, run: Run, graph: string): Promise<SinceAnswer> {
  const below = `/api/graphs/${encodeURIComponent(graph)}`;
  const query = new URLSearchParams({ limit: "1000", graph });
  const [runs, versions] = await Promise.all([
    fetchJson<Run[]>(`${runner}/api/runs?${query}`),
    fetchJson<Version[]>(`${below}/versions`),
  ]);
  const seqOf = (of: Run) => versions.find(({ id }) => id === of.version)?.seq;
  const good = lastGoodRun(runs, run.number);
  const [from, to] = [good === null ? undefined : seqOf(good), seqOf(run)];
  if (good === null || from === undefined || to === undefined || from > to) {
    return { good: null, found: null };
  }
  const { behaviours } = await recordedScriptOf(runner, run.id);
  const body = { good: from, bad: to, script: { behaviours } };
  return { good, found: await fetchJson(`${below}/since`, { method: "POST", body }) };
}

/** Asked once it is wanted; a run that is over is never asked about again. */
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
