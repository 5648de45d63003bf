/**
 * Presses of people on runs, each of which counts once even if its answer is lost; they may also bring another version.
 */
import { deviceNow } from "../clock/server-clock";
import type { RunBreakpoint } from "../graph/breakpoints";
import { newAid } from "../graph/document-keys";
import { runnerAt } from "./client";
import { isOutcomeUnknown } from "./http";
import { pathRefused } from "./refusal-places";
import { type Run, sightOf, type Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";
import { rememberedPerson } from "./session";

const KEY = "aa.presses";
const LONGEST = 20_000; // characters of what is kept beyond this page
const KEPT = 30 * 60_000; // ms; the same press later is another one

/** A request id, and the time of its first press, ms. */
type Pressed = readonly [request: string, at: number];

/** Takes what the page before this one has handed over. A page that lives leaves nothing there to be copied. */
function taken(): [string, Pressed][] {
  try {
    const kept = sessionStorage.getItem(KEY) ?? "{}";
    sessionStorage.removeItem(KEY);
    return Object.entries(JSON.parse(kept));
  } catch {
    return []; // a browser may forbid it
  }
}

/**
 * Request ids of presses whose answers got lost, by what was pressed. They live as long as the tab: a press that is
 * made again after the page was loaded anew counts once with the first. A copy of the tab has none of them: what is
 * pressed there is another press.
 */
const lostPresses = new Map(taken());

/** Hands the lost presses over to the page that is loaded next in this tab. */
function handOver(): void {
  const short = [...lostPresses].filter(([what]) => what.length < LONGEST);
  try {
    sessionStorage.setItem(KEY, JSON.stringify(Object.fromEntries(short)));
  } catch {
    // A tab that stores nothing still knows them until it is loaded anew.
  }
}

globalThis.addEventListener?.("pagehide", handOver);
globalThis.addEventListener?.("pageshow", ({ persisted }) => {
  if (persisted) taken(); // this page is there again, and knows them
});

/**
 * Sends a press with a request id of its own. If its answer gets lost, the next press of the same
 * thing by the same person is sent with the same id, so that the two count once: also after the page was loaded
 * anew, and also one after a press that was refused meanwhile, since the first may still be carried out. Where the
 * id itself is refused, the first was carried out and is over.
 */
export async function sendPress<T>(
  what: string,
  send: (request: string) => Promise<T>,
): Promise<T> {
  const press = `${rememberedPerson()?.id ?? ""} ${what}`;
  const known = lostPresses.get(press);
  const lost = known !== undefined && deviceNow() - known[1] < KEPT ? known : undefined;
  const [request, at] = lost ?? [newAid(), deviceNow()];
  lostPresses.set(press, [request, at]);
  try {
    const answer = await send(request);
    lostPresses.delete(press);
    return answer;
  } catch (error) {
    const isOver = lost === undefined || pathRefused(error).endsWith("/request_id");
    if (isOver && !isOutcomeUnknown(error)) lostPresses.delete(press);
    throw error;
  }
}

/** Let a held run go on, if it is still held since this moment. Robots may begin to move. */
export function letGoOn(
  runner: string,
  run: string,
  since: string,
  watching: Watching = {},
): Promise<Run> {
  return sendPress(`go on ${run} ${since}`, (request) => {
    const body = { since, request_id: request, watching };
    return runnerAt(runner).post("/api/runs/{run}/go_on", { path: { run }, body });
  });
}

/** The distance that a held run goes on: one action, or all that come before another one. */
export type StepGoal =
  | { readonly action: string }
  | { readonly until: string }
  | { readonly over: string[] };

/** Let a held run go on so far, if it is still held since this moment, and hold it again. */
export function letStep(
  runner: string,
  run: string,
  since: string,
  goal: StepGoal,
  watching: Watching = {},
): Promise<Run> {
  return sendPress(["step", run, since, JSON.stringify(goal)].join(" "), (request) => {
    const body = { since, request_id: request, watching, ...goal };
    return runnerAt(runner).post("/api/runs/{run}/step", { path: { run }, body });
  });
}

/**
 * Set where a led run waits. To take one away is a start. `was`: those that the person saw; it is refused if
 * there are others now.
 */
export function setRunBreakpoints(
  runner: string,
  run: string,
  breakpoints: readonly RunBreakpoint[],
  was: readonly RunBreakpoint[],
  watching: Watching,
): Promise<Run> {
  const sent = { breakpoints, was } as Pick<RunnerApi["BreakpointsRequest"], "breakpoints" | "was">;
  const body = { ...sent, watching };
  return runnerAt(runner).put("/api/runs/{run}/breakpoints", { path: { run }, body });
}

/**
 * Let a led run begin nothing further. What was begun goes on. Each press has an id of its own: a second one does
 * no harm, and one that counted with an earlier one would hold nothing.
 */
export function letWait(runner: string, run: string): Promise<Run> {
  const body = { request_id: newAid() };
  return runnerAt(runner).post("/api/runs/{run}/wait", { path: { run }, body });
}

/** An outcome by the word of a person. */
export type SaidOutcome = RunnerApi["WordRequest"]["outcome"];

/** Say how an action of a led run has ended, where nothing shows it. */
export function giveOutcome(
  runner: string,
  run: string,
  said: Omit<RunnerApi["WordRequest"], "request_id">,
): Promise<Run> {
  const word = { ...said, reason: said.reason.trim() };
  return sendPress(`outcome ${run} ${JSON.stringify(word)}`, (request) => {
    const body = { ...word, request_id: request };
    return runnerAt(runner).post("/api/runs/{run}/outcome", { path: { run }, body });
  });
}

/** Gives a run another version of its graph, by value. Its engine pauses it for that. */
export async function modifyRun(
  runner: string,
  run: string,
  version: { id: string; digest: string; umrf: string },
  watching: Watching,
): Promise<Run> {
  const sight = await sightOf(version.id);
  const body = {
    version: version.id,
    digest: version.digest,
    umrf: version.umrf,
    watching,
    ...sight,
  };
  return runnerAt(runner).post("/api/runs/{run}/modify", { path: { run }, body });
}
