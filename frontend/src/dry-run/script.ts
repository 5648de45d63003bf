/** Decisions of a person in a dry-run, as the script that the simulator plays. Pure. */
import type { Behaviour, Command, Script } from "../api/dry-runs";
import type { RunningAction } from "./playback";
import type { DryRunSeed } from "./seed";

export type DecidedOutcome = "on_true" | "on_false" | "on_error";
export type DecidedFaultKind = "error" | "never" | "exception" | "deaf" | "stop";

/** Decision about how one visit of an action ends. */
interface Decision {
  readonly node: string;
  readonly call: number;
  /** Begin of the visit, and time of the decision; ms since the start. */
  readonly since: number;
  readonly at: number;
  readonly outcome: DecidedOutcome;
}

/** Fault in a dry-run: an action that misbehaves, or a person who presses Stop. */
export type DecidedFault =
  | { readonly kind: Exclude<DecidedFaultKind, "stop">; readonly node: string }
  | { readonly kind: "stop"; readonly at: number };

export interface Decisions {
  readonly decisions: readonly Decision[];
  readonly fault: DecidedFault | null;
  /** Outcomes of actions before the first decision, one behaviour for each call. */
  readonly before?: DryRunSeed["behaviours"];
}

export const NOTHING_DECIDED: Decisions = { decisions: [], fault: null };

/** Return decisions without any entry, at a moment of a run if `seed` is given. */
export function decidedBy(seed: DryRunSeed | null): Decisions {
  return seed === null ? NOTHING_DECIDED : { ...NOTHING_DECIDED, before: seed.behaviours };
}

/** Return whether a visit that had ended by the moment of a run was decided differently since. */
export function rewritesRun({ decisions }: Decisions, { actions }: DryRunSeed): boolean {
  const ended = new Map(actions.map(({ node, ended }) => [node, ended]));
  return decisions.some(({ node, call }) => call < (ended.get(node) ?? 0));
}

export const faultWords: Readonly<Record<DecidedFaultKind, string>> = {
  error: "Ends with an error",
  never: "Never ends",
  exception: "Cannot be loaded (exception)",
  deaf: "Ignores Stop",
  stop: "Stop is pressed now",
};

const SOON = 100; // ms from a decision to the end that it decides

/**
 * Decides how a visit ends. What was decided at later times is forgotten: from here on the task
 * takes another way.
 */
export function decide(
  before: Decisions,
  going: RunningAction,
  outcome: DecidedOutcome,
  at: number,
): Decisions {
  const { node, call, since } = going;
  const earlier = before.decisions.filter(
    (other) => other.at <= at && !(other.node === node && other.call === call),
  );
  const fault = before.fault?.kind === "stop" && before.fault.at > at ? null : before.fault;
  return { ...before, decisions: [...earlier, { node, call, since, at, outcome }], fault };
}

const faulty: Readonly<Record<Exclude<DecidedFaultKind, "stop">, Behaviour>> = {
  error: { result: "on_error", message: "injected fault" },
  never: { never: true },
  exception: { init_error: true, message: "injected fault" },
  deaf: { ignores_stop: true },
};

/**
 * Returns the script of a dry-run. Each action has one behaviour for each call; the last repeats, so what nobody
 * decided comes last.
 */
export function scriptOf({ decisions, fault, before = {} }: Decisions): Script {
  const calls = new Map(Object.entries(before).map(([node, list]) => [node, [...list]]));
  const usual = (node: string): Behaviour =>
    fault !== null && fault.kind !== "stop" && fault.node === node ? faulty[fault.kind] : {};
  for (const { node, call, since, at, outcome } of decisions) {
    const list = calls.get(node) ?? [];
    while (list.length <= call) list.push(usual(node));
    const deaf = usual(node).ignores_stop ? { ignores_stop: true } : {};
    list[call] = { after_s: (at - since + SOON) / 1000, result: outcome, ...deaf };
    calls.set(node, list);
  }
  const nodes = new Set([...calls.keys()]);
  if (fault !== null && fault.kind !== "stop") nodes.add(fault.node);
  return {
    behaviours: Object.fromEntries(
      [...nodes].map((node) => [node, [...(calls.get(node) ?? []), usual(node)]]),
    ),
  };
}

export function commandsOf({ fault }: Decisions): Command[] {
  return fault?.kind === "stop" ? [{ at_ms: fault.at + 1, verb: "stop" }] : [];
}
