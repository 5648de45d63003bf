/** Says in words for each robot of a led run how far its rest is proven. */
import { enginesOf } from "../api/led-runs";
import type { Robot } from "../api/robots";
import { type Run, silentRests } from "../api/run-stop";
import type { RunnerApi } from "../api/schema/runner";
import { clock, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import { actionWords, spokenIn } from "./level-places";
import type { Tone } from "./progress";

export type RobotRest = RunnerApi["RobotRestShown"];

export interface RestLine {
  readonly robot: string;
  readonly tone: Tone;
  readonly words: string;
}

/** States in which nothing of the run goes on there, as far as its events tell. */
const RESTS: ReadonlySet<RobotRest["state"]> = new Set(["unused", "proven", "seen", "unsent"]);

/**
 * Return the robots of a led run that are not known to rest, those about which only a person can
 * tell first.
 */
export function openRests(run: Run): RobotRest[] {
  const silent = new Set(silentRests(run));
  const others = (run.rests ?? []).filter((rest) => !RESTS.has(rest.state) && !silent.has(rest));
  return [...silent, ...others].filter(({ piece }) => piece);
}

/** Return the actions of a led run that go on as far as is known: their rest is not proven. */
export function movingRests(run: Run): { action: string; robot: string }[] {
  return (run.rests ?? [])
    .filter(({ state, action }) => state === "going" && action)
    .map(({ action, robot }) => ({ action: action ?? "", robot }));
}

const sentence = (text: string) => text.replace(/\.$/, "");

export function restWords(rest: RobotRest, run: Run): Pick<RestLine, "tone" | "words"> {
  const at = instant(rest.since);
  const time = at === null ? "" : ` at ${clock(at)}`;
  const since = at === null ? "" : ` since ${clock(at)}`;
  const step = rest.action ? isolated(actionWords(run, rest.action)) : "its action";
  const why = rest.why ? `: ${isolated(spokenIn(run, sentence(rest.why)))}` : "";
  const stops = rest.stops ? "; the stop is repeated" : "";
  switch (rest.state) {
    case "unused":
      return { tone: "idle", words: "nothing was begun there" };
    case "going":
      return { tone: "run", words: `${step} goes on` };
    case "stopping":
      return { tone: "unknown", words: `rest not proven yet, the stop is repeated${why}` };
    case "silent":
      return { tone: "unknown", words: `silent${since}: not known${stops}` };
    case "unproven":
      return { tone: "unknown", words: `rest cannot be proven${why}${stops}` };
    case "proven":
      return { tone: "done", words: `proven at rest${time}` };
    case "seen": {
      const seen = rest.by ? `seen at rest by ${isolated(rest.by.name)}` : "seen at rest";
      return { tone: "stopped", words: `${seen}${time}, not proven${why}` };
    }
    case "unsent":
      return { tone: "idle", words: `${step} did not begin there` };
    default:
      return { tone: "unknown", words: "not known" };
  }
}

/**
 * Return a line for each robot of a led run, in the order of their names; none for another run.
 * `unheard`: the runner is not heard, so that only a proof that had come before is known.
 */
export function restLines(run: Run, unheard: boolean): RestLine[] {
  return (run.rests ?? []).map((rest) => {
    if (unheard && !RESTS.has(rest.state)) {
      return { robot: rest.robot, tone: "unknown", words: "not known, the runner is not heard" };
    }
    return { robot: rest.robot, ...restWords(rest, run) };
  });
}

/** Return the rest of a robot of a led run; null unless nothing of the run is known to go on there. */
export function knownRest(run: Run, robot: string): RobotRest | null {
  return (run.rests ?? []).find((each) => each.robot === robot && RESTS.has(each.state)) ?? null;
}

/** Return whether a run waits for something that a person has to say. */
export function asksPeople(run: Run, robots: readonly Robot[]): boolean {
  const isHeld = Boolean(run.held) || askedOutcomes(run).length > 0;
  return isHeld || isOutOfService(run, robots);
}

/** Return whether a robot of an open run is out of service. */
function isOutOfService(run: Run, robots: readonly Robot[]): boolean {
  if (run.ended_at !== null) return false;
  const engines = enginesOf(run);
  return robots.some(({ name, locks }) => locks.length > 0 && engines.includes(name));
}

/** Return the actions of a run whose outcome a person has to give, by full name. */
export function askedOutcomes(run: Run): string[] {
  if (run.ended_at !== null || run.desired === "stopped") return [];
  return Object.entries(run.actions ?? {})
    .filter(([, { asks }]) => asks)
    .map(([name]) => name);
}
