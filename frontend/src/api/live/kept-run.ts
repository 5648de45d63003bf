/** A run as it is told anew, in which everything that says the same keeps its identity. Pure. */
import { isEqual } from "../../graph/values";
import type { Run } from "../runs";

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
 * Each message tells of all actions, and few have changed: what did not is not drawn again. A run of
 * which nothing has changed is the one from before.
 */
export function withKeptParts(before: Run | undefined, now: Run): Run {
  if (before?.actions == null || now.actions == null) return now;
  const kept = { ...now, actions: keptActions(before.actions, now.actions) };
  return isEqual(before, kept) ? before : kept;
}

/** What nobody shall see later than it can be drawn: how the run itself stands, and what is alarming. */
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
