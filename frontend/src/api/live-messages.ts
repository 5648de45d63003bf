/** Validates messages of the runner, and keeps unchanged parts of a run. */
import { isEqual } from "../graph/stop-basics";
import type { Run } from "./run-stop";
import type { RunnerApi } from "./schema/runner";

type RunnerMessage = RunnerApi["RunnerMessage"];

/** Return a run whose end nobody has seen yet, as it is shown until the runner says how it ended. */
export function withUnseenEnd(run: Run, now: number): Run {
  const since = run.unknown_since ?? new Date(now).toISOString();
  return { ...run, state: "unknown", unknown_since: since };
}

const isObject = (part: unknown): part is object => typeof part === "object" && part !== null;
const isTextOrNull = (part: unknown) => part == null || typeof part === "string";

/** Returns whether this is a list of objects with these texts. */
function isListOf<T>(list: readonly T[], ...texts: readonly (keyof T)[]): boolean {
  const isWhole = (part: T) =>
    isObject(part) && texts.every((name) => typeof part[name] === "string");
  return Array.isArray(list) && list.every(isWhole);
}

/** Throws an error if a message lacks what each robot and each run has: STOP and its notices read it. */
export function checkMessage(message: RunnerMessage): void {
  const { type } = message;
  const robots = type === "hello" || type === "engines" ? message.engines : [];
  const runs: Run[] = type === "hello" ? message.runs : type === "run" ? [message.run] : [];
  const isSound =
    isListOf(robots, "name") &&
    robots.every(
      ({ holds }) => isListOf(holds, "graph") && holds.every(({ run }) => isTextOrNull(run)),
    ) &&
    isListOf(runs, "id") &&
    runs.every(
      ({ alarms, unconfirmed, actions, rests }) =>
        isListOf(alarms, "code", "text") &&
        isTextOrNull(unconfirmed) &&
        Object.values(actions ?? {}).every(isObject) &&
        isListOf(rests ?? [], "robot") &&
        (rests ?? []).every(({ why }) => isTextOrNull(why)),
    ) &&
    (type !== "confirm" || isListOf(message.asked));
  if (!isSound) throw new TypeError("The message lacks a required field.");
}

type RunActionsTold = NonNullable<Run["actions"]>;

function keptActions(before: RunActionsTold, now: RunActionsTold): RunActionsTold {
  let changed = Object.keys(before).length !== Object.keys(now).length;
  const kept: RunActionsTold = {};
  for (const [name, action] of Object.entries(now)) {
    const known = before[name];
    if (known !== undefined && isEqual(known, action)) kept[name] = known;
    else {
      kept[name] = action;
      changed = true;
    }
  }
  return changed ? kept : before;
}

/**
 * Returns the new state of a run with the same objects for all that has not changed, so that it is not drawn again;
 * `before` itself if nothing has.
 */
export function withKeptParts(before: Run | undefined, now: Run): Run {
  if (before?.actions == null || now.actions == null) return now;
  const kept = { ...now, actions: keptActions(before.actions, now.actions) };
  return isEqual(before, kept) ? before : kept;
}

/** Fields that must be shown without delay: the state of the run itself, and alarms. */
const URGENT = [
  "state",
  "desired",
  "ended_at",
  "unconfirmed",
  "unknown_since",
  "moves_again_at",
  "at_rest",
  "proof_at",
  "recorded",
  "stopped_by",
] as const satisfies readonly (keyof Run)[];

export function isUrgentChange(before: Run | undefined, now: Run): boolean {
  if (before === undefined || before.alarms.length !== now.alarms.length) return true;
  return URGENT.some((field) => !isEqual(before[field], now[field]));
}
