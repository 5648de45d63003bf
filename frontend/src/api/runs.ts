/** Runs as the runner tells them. */
import { useQuery } from "@tanstack/react-query";
import { fetchJson } from "./http";

type RunState =
  | "requested"
  | "published"
  | "running"
  | "paused"
  | "stopping"
  | "unknown"
  | "finished"
  | "halted"
  | "stopped"
  | "error"
  | "refused"
  | "lost";

type RunResult = "on_true" | "on_false" | "on_error" | "on_stopped" | "on_halted";

type VisitResult = "true" | "false" | "error" | "stopped" | null;

/** Seconds: at least `least`, at most `most`; null: nothing bounds it from above. */
export interface DurationBounds {
  least: number;
  most: number | null;
}

/** One execution: it began between `not_before` and `from`, and ended between `until` and
 * `not_after` (null: it may go on still). Where `until` lies before `from`, no moment is known at
 * which it went on for certain. */
export interface Visit {
  from: string | null;
  not_before: string | null;
  not_after: string | null;
  until: string | null;
  result: VisitResult;
  how: "observed" | "inferred";
  /** Values that the engine reported, as JSON texts by flat name; null when nobody saw them. */
  inputs?: Record<string, string> | null;
}

export interface ActionRun {
  aid: string | null;
  state: string;
  visits: Visit[];
  /** Earlier visits that are not listed. */
  older: number;
  messages: { at: string; text: string }[];
}

/** Who asked for something, and from where: `address` is missing for the runner's own computer. */
export interface Requester {
  id: string;
  name: string;
  by?: "browser" | "program";
  address?: string;
}

/** Where somebody asked from, as words that follow the name; "" where it was not recorded. */
export function requesterPlace(asker: Requester | null): string {
  if (asker?.by === undefined) return "";
  return ` · by ${asker.by}, from ${asker.address ?? "this computer"}`;
}

export interface Run {
  id: string;
  number: number;
  graph: string | null;
  graph_name: string;
  version: string | null;
  digest: string;
  engine: string;
  simulated: boolean;
  state: RunState;
  desired: "running" | "paused" | "stopped";
  proof_at: string | null;
  unknown_since: string | null;
  /** Why no answer of its engine can show rest any more; null when one can. */
  unconfirmed?: string | null;
  /** Who has seen it at rest instead; `by` null: the runner, which saw the engine's process end. */
  at_rest?: { by: Requester | null; at: string; how: string } | null;
  /** It had ended, and its engine shows it moving; null at its next end. */
  moves_again_at: string | null;
  result: RunResult | null;
  requested_at: string;
  started_at: string | null;
  ended_at: string | null;
  /** From the start to when nothing of it moved any more, as far as that was seen. */
  took?: DurationBounds | null;
  author: Requester | null;
  stopped_by: Requester | null;
  /** Why it was refused, lost or ended so. */
  detail: string;
  alarms: { code: string; at: string; text: string }[];
  /** Shared by runs that were started together. */
  group: string | null;
  /** Whether the journal has all of it. */
  recorded: boolean;
  /** The robot whose engine the simulator plays. */
  like?: string | null;
  actions?: Record<string, ActionRun>;
  /** The newest lines of the engine's own log. */
  log?: { at: string; text: string }[];
  umrf?: unknown;
  /** Since when its events stand in an archive, and in which file. */
  archived?: { at: string; file: string } | null;
  /** Values of actions as they were sent: action, parameter, JSON text as in `inputs`. */
  sent?: Record<string, Record<string, string>>;
  /** Problems that somebody started in spite of, and why. */
  override?: { codes: string[]; reason: string } | null;
  despite?: { code: string; text?: string; aid?: string | null }[];
}

/** Where it ran, in a few words. */
export function runPlace(run: Run): string {
  if (!run.simulated) return run.engine;
  return run.engine === "simulator" ? "simulator" : `${run.engine} (simulated)`;
}

/** The engine whose abilities count: the simulator has those of the robot that it plays. */
export function abilitiesOf(run: Run): string {
  return run.like ?? run.engine;
}

/** The newest alarm that still holds: that nothing moves is over once something has begun. */
export function currentAlarm(run: Run): Run["alarms"][number] | undefined {
  const begun = Object.values(run.actions ?? {}).map(({ visits }) => visits.at(-1)?.from ?? "");
  const newest = Math.max(0, ...begun.map((at) => Date.parse(at) || 0));
  return run.alarms.findLast(({ code, at }) => code !== "stalled" || Date.parse(at) >= newest);
}

/** A lost run has not: nobody has seen it at rest yet. */
export function hasEnded(run: Run): boolean {
  return run.ended_at !== null;
}

const MOVES: ReadonlySet<string> = new Set(["RUNNING", "STOPPING", "PAUSE_REQUESTED", "PAUSED"]);

/** Whether a person's word can end the run, since no answer of its engine can. */
export function needsRestConfirmation(run: Run): boolean {
  if (hasEnded(run) || run.simulated || run.started_at === null) return false;
  if (run.state === "lost" || run.unknown_since !== null) return true;
  const moves = Object.values(run.actions ?? {}).some((action) => MOVES.has(action.state));
  return Boolean(run.unconfirmed) && !moves;
}

/** Says that somebody has seen the run at rest, and how. */
export function confirmRest(runner: string, run: string, how: string): Promise<Run> {
  const path = `/api/runs/${encodeURIComponent(run)}/at_rest`;
  return fetchJson(`${runner}${path}`, { method: "POST", body: { how } });
}

export interface StartOrder {
  runner: string;
  version: string;
  digest: string;
  /** JSON text, sent exactly as the editor gave it. */
  umrf: string;
  graph: string;
  /** One engine, or several robots that start together. */
  engines: readonly string[];
  request: string;
  /** What actions do; only the simulator follows one. */
  script?: unknown;
  override?: { codes: readonly string[]; reason: string };
}

export interface Started {
  runs: Run[];
  /** Robots that nothing was sent to, and why. */
  failed: Record<string, string>;
}

/** Starts a version by value. The same `request` never starts twice. */
export async function startRun(order: StartOrder): Promise<Started> {
  const [engine, ...others] = order.engines;
  const alone = others.length === 0;
  const head = JSON.stringify({
    version: order.version,
    digest: order.digest,
    graph: order.graph,
    ...(alone ? { engine } : { engines: order.engines }),
    request_id: order.request,
    ...(order.override === undefined ? {} : { override: order.override }),
    ...(order.script === undefined ? {} : { script: order.script }),
  });
  const body = `${head.slice(0, -1)},"umrf":${order.umrf}}`;
  if (!alone) return fetchJson(`${order.runner}/api/groups`, { method: "POST", body });
  const run = await fetchJson<Run>(`${order.runner}/api/runs`, { method: "POST", body });
  return { runs: [run], failed: {} };
}

/** What the runner knows of a start. Without runs and not `under_way`: nothing so far. */
export interface StartFound {
  request_id: string;
  under_way: boolean;
  runs: Run[];
}

export function findStart(
  runner: string,
  request: string,
  patience: number,
  signal?: AbortSignal,
): Promise<StartFound> {
  const path = `${runner}/api/starts/${encodeURIComponent(request)}`;
  return fetchJson(path, { timeoutMs: patience, ...(signal ? { signal } : {}) });
}

/** Asks to stop one run, or all of them. */
export function postStop(runner: string, run: string | "all", stop: string): Promise<unknown> {
  const path = run === "all" ? "/api/stop" : `/api/runs/${encodeURIComponent(run)}/stop`;
  return fetchJson(`${runner}${path}`, {
    method: "POST",
    body: { stop_id: stop },
    timeoutMs: 3_000,
  });
}

/** Pauses a run, or lets it go on. */
export function pauseOrResume(runner: string, run: string, way: "pause" | "resume"): Promise<Run> {
  return fetchJson(`${runner}/api/runs/${encodeURIComponent(run)}/${way}`, {
    method: "POST",
    body: {},
  });
}

/** Gives a run another version of its graph, by value. Its engine pauses it for that. */
export function modifyRun(
  runner: string,
  run: string,
  version: { id: string; digest: string; umrf: string },
): Promise<Run> {
  const head = JSON.stringify({ version: version.id, digest: version.digest });
  const body = `${head.slice(0, -1)},"umrf":${version.umrf}}`;
  return fetchJson(`${runner}/api/runs/${encodeURIComponent(run)}/modify`, {
    method: "POST",
    body,
  });
}

export function useRuns(runner: string | undefined, graph?: string) {
  const filter = graph === undefined ? "" : `&graph=${encodeURIComponent(graph)}`;
  return useQuery({
    queryKey: ["runs", "list", graph ?? ""],
    queryFn: ({ signal }) => fetchJson<Run[]>(`${runner}/api/runs?limit=200${filter}`, { signal }),
    enabled: runner !== undefined,
  });
}

export function getRun(runner: string, id: string, signal?: AbortSignal): Promise<Run> {
  return fetchJson(`${runner}/api/runs/${encodeURIComponent(id)}`, signal ? { signal } : {});
}

/** The newest run of a graph, whole; null when it never ran. */
export function useLastRun(runner: string | undefined, graph: string) {
  return useQuery({
    queryKey: ["runs", "last", graph],
    queryFn: async ({ signal }) => {
      const path = `${runner}/api/runs?limit=1&graph=${encodeURIComponent(graph)}`;
      const [newest] = await fetchJson<Run[]>(path, { signal });
      return newest ? getRun(runner ?? "", newest.id, signal) : null;
    },
    enabled: runner !== undefined,
  });
}

export function useRun(runner: string | undefined, id: string) {
  return useQuery({
    queryKey: ["runs", "one", id],
    queryFn: ({ signal }) => getRun(runner ?? "", id, signal),
    enabled: runner !== undefined,
  });
}
