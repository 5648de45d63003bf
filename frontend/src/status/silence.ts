/** Tells of which actions of a run nothing is heard now: of all, or of those on robots that do not answer. */
import { useMemo } from "react";
import { type LiveState, silentRobots, stateOf } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { MOVES } from "../api/run-stop";
import type { ActionRun, Run } from "../api/runs";
import { serverTimeOf } from "../clock/server-clock";
import { instant } from "../ui/times";
import { type Unsure, visitBegin } from "./progress";

/** Returns what is not heard of a run now; the same set again while the same robots are silent. */
export function useUnsure(run: Run | null): Unsure {
  const { now } = useLive();
  const names = JSON.stringify([...silentRobots(now)].sort());
  const silent = useMemo(() => new Set<string>(JSON.parse(names)), [names]);
  return (stateOf(now, run?.id).link === "down" && run?.ended_at === null) || silent;
}

/**
 * Return since when it is not known how an action goes on because its robot does not answer, ms;
 * null if the robot answers, and for an action that does not move.
 */
export function silentSinceOf(action: ActionRun, now: LiveState): number | null {
  const { robot = "", state, visits } = action;
  if (!MOVES.has(state) || !silentRobots(now).has(robot)) return null;
  if (now.link !== "live") return serverTimeOf(now.since);
  const since = instant(now.engines.find(({ name }) => name === robot)?.since);
  const last = visits.at(-1);
  return since ?? (last ? visitBegin(last) : null);
}

/**
 * Return since when no answer can show any more how an action of a led run ended, ms; null unless a
 * person is asked for its outcome.
 */
export function endUnknownSince(action: ActionRun, run: Run): number | null {
  if (!action.asks) return null;
  const rest = run.rests?.find(({ robot }) => robot === action.robot);
  const told = [run.held?.since, rest?.since].flatMap((at) => instant(at) ?? []);
  const last = action.visits.at(-1);
  return told.length > 0 ? Math.min(...told) : last ? visitBegin(last) : null;
}
