/** State of an action of a run, and of the run, in one word and one tone. */

import type { LiveState } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { MOVES } from "../api/run-stop";
import type { ActionRun, Run, Visit } from "../api/runs";
import { shiftOfRun } from "../api/site-places";
import { serverTimeOf } from "../clock/server-clock";
import { clock } from "../ui/times";
import { isolated } from "../words/isolated";

export type Tone = "idle" | "run" | "true" | "false" | "error" | "stopped" | "done" | "unknown";

export interface Progress {
  /** The action's full name in the run, where it is one of a run. */
  name?: string;
  tone: Tone;
  word: string;
  /** Begin of the present visit by the clock of the page, ms; null if none goes on. */
  since: number | null;
  /** Lower bound of the duration of the last visit, ms; null if none ended. */
  took: number | null;
  /**
   * Upper bound of the duration, ms, if its ends were not seen exactly (Infinity: its code may
   * still run); null if they were.
   */
  atMost: number | null;
  /** Number of visits, as far as known. */
  visits: number;
  /** Set if there may have been more visits: an engine is not seen at every moment. */
  atLeast?: boolean;
  inferred: boolean;
  /** The values with which the last visit ran, as the engine reported them: JSON texts by flat name. */
  inputs?: Readonly<Record<string, string>>;
  message: string | null;
}

const time = (text: string | null | undefined): number | null => (text ? Date.parse(text) : null);

export function visitBegin(visit: Visit): number | null {
  return time(visit.from) ?? time(visit.not_before) ?? time(visit.not_after);
}

export function visitEnd(visit: Visit): number | null {
  return time(visit.until);
}

/** The tone of a result, by its word. */
export const resultTone: Readonly<Record<string, Tone>> = {
  true: "true",
  false: "false",
  error: "error",
  stopped: "stopped",
  on_true: "true",
  on_false: "false",
  on_error: "error",
  on_stopped: "stopped",
  on_halted: "stopped",
};

interface StateWords {
  readonly tone: Tone;
  readonly word: string;
}

/** Words for states of an engine that a run and a dry-run say alike. */
export const STATE_WORDS: ReadonlyMap<string, StateWords> = new Map<string, StateWords>([
  ["RUNNING", { tone: "run", word: "running" }],
  ["PAUSE_REQUESTED", { tone: "run", word: "pausing" }],
  ["PAUSED", { tone: "stopped", word: "paused" }],
  ["STOPPING", { tone: "stopped", word: "stopping" }],
  ["ERROR", { tone: "error", word: "error" }],
]);

/** Return the words for an action that ended with a result. */
export function finishedWords(result: string | null | undefined): StateWords {
  if (!result) return { tone: "done", word: "finished" };
  const tone = resultTone[result] ?? "done";
  return { tone, word: result.replace(/^on_/, "") };
}

/** Return in words how the result of a visit is known; "" for one that an engine has shown. */
export function howWords(visit: Visit): string {
  if (visit.said) return `said by ${isolated(visit.said.by.name)}: ${isolated(visit.said.reason)}`;
  return visit.how === "inferred" ? "inferred" : "";
}

function stateOf(action: ActionRun, over: boolean, unsure: boolean): StateWords {
  const last = action.visits.at(-1);
  if (action.asks && !over) return { tone: "unknown", word: "outcome not known" };
  if (last?.said && !MOVES.has(action.state)) {
    const { tone, word } = finishedWords(last.result);
    return { tone, word: `${word}, said by ${isolated(last.said.by.name)}` };
  }
  if (MOVES.has(action.state)) {
    if (over) return { tone: "unknown", word: "end not seen" };
    if (unsure) return { tone: "unknown", word: "unknown" };
  }
  const words = STATE_WORDS.get(action.state);
  if (words !== undefined) return words;
  if (action.state === "BYPASSED") return { tone: "done", word: "passed over" };
  if (action.state === "FINISHED") return finishedWords(last?.result);
  if (last !== undefined && visitEnd(last) !== null) return finishedWords(last.result);
  return { tone: "idle", word: over ? "did not run" : "waits" };
}

/**
 * Return the upper bound of the duration of a visit; null if its ends are known exactly, and while
 * it goes on.
 */
export function visitDurationBound(visit: Visit): number | null {
  const [from, until] = [time(visit.from), time(visit.until)];
  const [before, after] = [time(visit.not_before), time(visit.not_after)];
  if (from === null || until === null || before === null) return null;
  if (after === null) return Number.POSITIVE_INFINITY;
  return before === from && until === after ? null : after - before;
}

/** Return the lower and upper bound of the duration of a visit, ms. */
export function visitDuration(visit: Visit): Pick<Progress, "took" | "atMost"> {
  const [from, until] = [visitBegin(visit), visitEnd(visit)];
  const took = from !== null && until !== null ? Math.max(0, until - from) : null;
  return { took, atMost: visitDurationBound(visit) };
}

/** True: nothing is heard of a run. A set: the robots that do not answer, of which a led run may have some. */
export type Unsure = boolean | ReadonlySet<string>;

function isUnsure(action: ActionRun, run: Run, unsure: Unsure): boolean {
  if (unsure === true || run.state === "unknown") return true;
  return unsure !== false && unsure.has(action.robot ?? "");
}

export function progressOf(action: ActionRun, run: Run, unsure: Unsure): Progress {
  const over = run.ended_at !== null;
  const { tone, word } = stateOf(action, over, isUnsure(action, run, unsure));
  const last = action.visits.at(-1);
  const from = last ? visitBegin(last) : null;
  const until = last ? visitEnd(last) : null;
  return {
    tone,
    word,
    since:
      from === null || until !== null || over || action.asks ? null : from + shiftOfRun(run.id),
    ...(last ? visitDuration(last) : { took: null, atMost: null }),
    visits: action.count ?? action.older + action.visits.length,
    ...(action.at_least ? { atLeast: true } : {}),
    inferred: last?.how === "inferred" && !last.said,
    ...(last?.inputs ? { inputs: last.inputs } : {}),
    message: action.messages.at(-1)?.text ?? null,
  };
}

/** Return the number of visits in words; "" for exactly one, or if none was seen. */
export function visitsText({ visits, atLeast }: Pick<Progress, "visits" | "atLeast">): string {
  if (atLeast) return visits > 0 ? `≥ ${visits}×` : "";
  return visits > 1 ? `${visits}×` : "";
}

/** The last progress of each action, reused until the action or its run changes. */
const lastSaid = new WeakMap<ActionRun, { key: string; progress: Progress }>();

export function progressOfAction(
  name: string,
  action: ActionRun,
  run: Run,
  unsure: Unsure,
): Progress {
  const shift = Math.round(shiftOfRun(run.id) / 500);
  const key = `${name} ${run.ended_at !== null} ${isUnsure(action, run, unsure)} ${shift}`;
  const before = lastSaid.get(action);
  if (before?.key === key) return before.progress;
  const progress = { name, ...progressOf(action, run, unsure) };
  lastSaid.set(action, { key, progress });
  return progress;
}

/**
 * Progress by `aid`; actions of sub-graphs, which carry none, are left out. What is told of an action
 * that did not change is the same object again.
 */
export function progressByAid(run: Run | null, unsure: Unsure): Map<string, Progress> {
  const found = new Map<string, Progress>();
  if (run === null) return found;
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    if (action.aid) found.set(action.aid, progressOfAction(name, action, run, unsure));
  }
  return found;
}

/**
 * Progress as it was at a moment, ms: what went on then had gone on for so long. `shift`: from the clock of the run to
 * that of the page.
 */
export function progressAt(
  found: Map<string, Progress>,
  at: number | null,
  shift = 0,
): Map<string, Progress> {
  if (at === null) return found;
  for (const [aid, progress] of found) {
    if (progress.since === null) continue;
    found.set(aid, { ...progress, since: null, took: Math.max(0, at + shift - progress.since) });
  }
  return found;
}

/** Nobody knows how a run goes on. `since`: ms. */
function unknownStatus(since: number): { tone: Tone; word: string } {
  return { tone: "unknown", word: `unknown since ${clock(since)}` };
}

const runTones: Record<Run["state"], Tone> = {
  requested: "run",
  published: "run",
  running: "run",
  paused: "stopped",
  stopping: "stopped",
  unknown: "unknown",
  finished: "true",
  halted: "stopped",
  stopped: "stopped",
  error: "error",
  refused: "error",
  lost: "unknown",
};

/** The run's state, with the result where it has one that says more. */
export function runLabel(run: Run): { tone: Tone; word: string } {
  if (run.moves_again_at) return { tone: "error", word: "MOVES AGAIN" };
  if (run.unconfirmed && run.ended_at === null && run.state !== "running") {
    return { tone: "error", word: run.state === "lost" ? "lost" : "stop unconfirmed" };
  }
  if (run.state === "unknown" && run.unknown_since) {
    return unknownStatus(Date.parse(run.unknown_since));
  }
  if (run.state === "finished" && run.result && run.result !== "on_true") {
    const word = run.result.replace(/^on_/, "");
    return { tone: resultTone[run.result] ?? "done", word: `finished: ${word}` };
  }
  if (run.state === "finished" && !run.result) return { tone: "done", word: "finished" };
  if (run.held && run.state === "running") return { tone: "run", word: "running, held" };
  const word = run.state === "published" ? "starting" : run.state;
  return { tone: runTones[run.state] ?? "unknown", word };
}

/** The end in words, for history. */
export function runEndText(run: Run): string {
  const { word } = runLabel(run);
  const by = run.stopped_by?.name;
  if (run.state === "stopped" && by) return `stopped by ${isolated(by)}`;
  if (run.at_rest?.by) return `${word}: seen at rest by ${isolated(run.at_rest.by.name)}`;
  if (run.at_rest) return `${word}: its engine has ended`;
  if (run.state === "lost") return "lost: nothing proves its end";
  if (run.state === "finished" && run.result === "on_true") return "finished";
  return word;
}

export type Heard = Pick<LiveState, "link" | "since">;

/** Return the state of a run in a word: *unknown* while the runner is not heard, unless the run has ended. */
export function runStatus(run: Run, { link, since }: Heard): { tone: Tone; word: string } {
  if (run.ended_at === null && link === "down") {
    return unknownStatus(serverTimeOf(since));
  }
  return runLabel(run);
}

/** Return the state of a run; for an end also who or what caused it. */
export function useRunStatus(run: Run): { tone: Tone; word: string } {
  const { now } = useLive(run.id);
  const { tone, word } = runStatus(run, now);
  return { tone, word: run.ended_at === null ? word : runEndText(run) };
}
