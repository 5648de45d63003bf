import { expect, test } from "vitest";
import type { ActionRun, Run } from "../api/runs";
import {
  progressByAid,
  progressOf,
  runEndText,
  runLabel,
  runStatus,
  type Unsure,
  visitsText,
} from "./progress";
import { isInRun, progressInside } from "./progress-inside";

const run: Run = {
  id: "r",
  number: 1,
  graph: "g",
  graph_name: "g",
  version: "v",
  digest: "d",
  engine: "simulator",
  simulated: true,
  state: "running",
  desired: "running",
  proof_at: null,
  unknown_since: null,
  unconfirmed: null,
  at_rest: null,
  took: null,
  moves_again_at: null,
  result: null,
  requested_at: "2026-01-01T00:00:00Z",
  started_at: "2026-01-01T00:00:00Z",
  ended_at: null,
  author: { id: "p", name: "Ada" },
  stopped_by: null,
  detail: "",
  alarms: [],
  recorded: true,
  robots: null,
  held: null,
  group: null,
};

const visit = {
  from: "2026-01-01T00:00:01Z",
  not_before: "2026-01-01T00:00:00Z",
  not_after: null,
  until: null,
  result: null,
  how: "observed",
  inputs: null,
} as const;

test.each(["RUNNING", "PAUSE_REQUESTED", "PAUSED", "STOPPING"])(
  "an action that was %s is unknown while nothing is heard, and its end was not seen when all is over",
  (state) => {
    const action: ActionRun = { ...going, state };
    expect(progressOf(action, run, false).tone).not.toBe("unknown");
    expect(progressOf(action, run, true)).toMatchObject({ tone: "unknown", word: "unknown" });
    const over = { ...run, ended_at: "2026-01-01T00:00:09Z" };
    expect(progressOf(action, over, false)).toMatchObject({
      tone: "unknown",
      word: "end not seen",
    });
  },
);

test("visits that may have been missed are counted as at least so many", () => {
  const loop: ActionRun = { ...going, older: 3, count: 7, at_least: true };
  expect(visitsText(progressOf(loop, run, false))).toBe("≥ 7×");
  expect(visitsText(progressOf({ ...going, at_least: true }, run, false))).toBe("≥ 1×");
  expect(visitsText(progressOf({ ...going, older: 3 }, run, false))).toBe("4×");
  expect(visitsText(progressOf(going, run, false))).toBe("");
});

const going: ActionRun = { aid: "a", state: "RUNNING", visits: [visit], older: 0, messages: [] };

test("an action that runs says since when", () => {
  const progress = progressOf(going, run, false);
  expect([progress.tone, progress.word]).toEqual(["run", "running"]);
  expect(progress.since).toBe(Date.parse(visit.from));
});

test("while nobody hears of the run, what ran is unknown", () => {
  expect(progressOf(going, run, true).tone).toBe("unknown");
  expect(progressOf(going, { ...run, state: "unknown" }, false).tone).toBe("unknown");
});

const SILENT: ReadonlySet<string> = new Set(["David"]);

test.each(["RUNNING", "PAUSE_REQUESTED", "PAUSED", "STOPPING"])(
  "in a led run what was %s on a robot that does not answer is unknown, and on another one it is not",
  (state) => {
    const on = (aid: string, robot: string): ActionRun => ({ ...going, state, aid, robot });
    const actions = { A_0: on("a", "David"), B_0: on("b", "Carol"), C_0: on("c", "") };
    const led = { ...run, actions, robots: { Scout: "David", Carrier: "Carol" } };
    const keys = Object.entries({ a: "A", b: "B", c: "C" });
    const graph = { actions: keys.map(([key, name]) => ({ key, name, instanceId: 0 })) } as never;
    const tones = (silent: ReadonlySet<string>) => [
      [...progressByAid(led, silent)].map(([aid, { tone }]) => aid + (tone === "unknown")),
      [...progressInside(led, silent, { graph, names: [] })].map(
        ([aid, { tone }]) => aid + (tone === "unknown"),
      ),
    ];
    const unknown = ["atrue", "bfalse", "cfalse"];
    const known = ["afalse", "bfalse", "cfalse"];
    expect(tones(new Set())).toEqual([known, known]);
    expect(tones(SILENT)).toEqual([unknown, unknown]);
    expect(tones(new Set())).toEqual([known, known]);
  },
);

test("what ended on a robot that does not answer now stays as it ended", () => {
  const ended: ActionRun = {
    ...{ ...going, state: "FINISHED", robot: "David" },
    visits: [{ ...visit, until: visit.from, result: "true" }],
  };
  expect(progressOf(ended, run, SILENT).word).toBe("true");
  const over = { ...run, ended_at: "2026-01-01T00:00:09Z" };
  expect(progressOf({ ...going, robot: "David" }, over, SILENT).word).toBe("end not seen");
});

test("an end that was not seen is not told as one of the four outcomes", () => {
  const ended: ActionRun = {
    ...going,
    state: "FINISHED",
    visits: [{ ...visit, until: visit.from }],
  };
  expect(progressOf(ended, run, false)).toMatchObject({ tone: "done", word: "finished" });
});

test("actions of sub-graphs carry no place on this canvas", () => {
  const actions = { A_0: going, SUB__A_0: { ...going, aid: null } };
  expect([...progressByAid({ ...run, actions }, false).keys()]).toEqual(["a"]);
});

test("a graph inside of a run has the states of its own level, by name, and of no other", () => {
  const bare: ActionRun = { ...going, aid: null };
  const ended: ActionRun = {
    ...bare,
    state: "FINISHED",
    visits: [{ ...visit, result: "true" }],
  };
  const actions = {
    Fetch_0: going,
    Other_0: going,
    "g__Fetch__0/Grip_0": bare,
    "g__Fetch__0__Grip__0/Close_0": ended,
    "g__Other__0/Grip_0": bare,
    "g__Other__0__Grip__0/Close_0": bare,
  };
  const nested = { ...run, actions };
  const inside = (name: string) => ({ actions: [{ key: "k", name, instanceId: 0 }] }) as never;
  const told = (name: string, ...names: string[]) =>
    progressInside(nested, false, { graph: inside(name), names }).get("k")?.word;
  expect(told("Grip", "Fetch")).toBe("running");
  expect(told("Close", "Fetch", "Grip")).toBe("true");
  expect(told("Close", "Other", "Grip")).toBe("running");
  expect(told("Close", "Grip")).toBeUndefined();
  expect(told("Close", "Fetch")).toBeUndefined();
  expect(told("Fetch", "Fetch")).toBeUndefined();
  expect([isInRun(nested, ["Fetch"]), isInRun(nested, ["F.tch"])]).toEqual([true, false]);
  expect(isInRun({ ...nested, graph_name: "h" }, ["Fetch"])).toBe(false);
});

test("a run is called stopped or finished only by its own state", () => {
  expect(runLabel({ ...run, desired: "stopped" }).word).toBe("running");
  expect(runLabel({ ...run, state: "stopping" }).word).toBe("stopping");
  const stopped = { ...run, state: "stopped", stopped_by: { id: "q", name: "Mari" } } as const;
  expect(runEndText(stopped)).toBe("stopped by Mari");
  expect(runLabel({ ...run, state: "finished", result: "on_error" }).tone).toBe("error");
});

test("a run that moves again is never called by the end that it had", () => {
  const again = { ...run, desired: "stopped", state: "stopping", moves_again_at: "t" } as const;
  expect(runLabel(again)).toEqual({ tone: "error", word: "MOVES AGAIN" });
  expect(runLabel({ ...again, state: "unknown", unknown_since: "t" }).word).toBe("MOVES AGAIN");
});

test("what is known between bounds is no value, and what may go on has no upper one", () => {
  const seen = { ...visit, until: "2026-01-01T00:00:03Z", not_after: "2026-01-01T00:00:04Z" };
  const told = (one: Partial<typeof seen>) =>
    progressOf({ ...going, state: "FINISHED", visits: [{ ...seen, ...one } as never] }, run, false);
  expect(told({})).toMatchObject({ took: 2_000, atMost: 4_000 });
  expect(told({ until: "2026-01-01T00:00:00Z" })).toMatchObject({ took: 0, atMost: 4_000 });
  expect(told({ not_after: null as never }).atMost).toBe(Number.POSITIVE_INFINITY);
  expect(told({ not_before: visit.from as never, not_after: seen.until }).atMost).toBeNull();
});

test("a run that finished with a result that nobody told is not called true", () => {
  const over = { ...run, state: "finished", ended_at: "t" } as const;
  expect(runLabel(over)).toEqual({ tone: "done", word: "finished" });
  expect(runLabel({ ...over, result: "on_true" }).tone).toBe("true");
});

const heardRun = (part: Partial<Run>) => ({ ended_at: null, ...part }) as Run;
const SINCE = Date.parse("2026-11-26T12:00:00Z");
const DOWN = { link: "down", since: SINCE } as const;

test.each(["requested", "published", "running", "paused", "stopping"] as const)(
  "a run that was %s is unknown while the runner is not heard",
  (state) => {
    const going = heardRun({ state });
    expect(runStatus(going, { link: "live", since: SINCE }).tone).not.toBe("unknown");
    expect(runStatus(going, DOWN).tone).toBe("unknown");
    expect(runStatus(going, DOWN).word).toMatch(/^unknown since \d/);
  },
);

test("what has ended stays as it ended, whoever is heard", () => {
  const ended = heardRun({ state: "stopped", ended_at: "2026-11-26T11:59:00Z" });
  expect(runStatus(ended, DOWN)).toEqual({ tone: "stopped", word: "stopped" });
});

test("the card of an opened sub-graph says what runs inside, what is not known, and never an outcome", () => {
  const done = { ...visit, until: visit.from, result: "true" } as const;
  const inner = (state: string, robot = "David", ended = state === "FINISHED"): ActionRun => ({
    ...going,
    ...{ aid: null, state, robot, levels: ["Pick_0", "Grip_1"] },
    visits: ended ? [done] : state === "UNINITIALIZED" ? [] : [visit],
  });
  const keyed = (name: string, instanceId: number) =>
    ({ actions: [{ key: "k", name, instanceId }] }) as never;
  const told = (states: ActionRun[], silent: Unsure = false, over = false) => {
    const actions = Object.fromEntries(states.map((each, i) => [`Do_${i}`, each]));
    const opened = { ...run, actions, ...(over && { ended_at: "2026-01-01T00:00:09Z" }) };
    const own = progressInside(opened, silent, { graph: keyed("Pick", 0), names: [] }, true).get(
      "k",
    );
    const below = progressInside(opened, silent, { graph: keyed("Grip", 1), names: ["Pick"] });
    expect(below.get("k")).toEqual(own);
    expect(progressInside(opened, silent, { graph: keyed("Pick", 0), names: [] }).get("k")).toEqual(
      own,
    );
    return `${own?.tone}: ${own?.word}`;
  };
  const waits = inner("UNINITIALIZED");
  expect(told([waits, waits])).toBe("idle: waits");
  expect(told([waits, waits], false, true)).toBe("idle: did not run");
  expect(told([inner("FINISHED"), inner("RUNNING"), waits])).toBe("run: running");
  expect(told([inner("STOPPING"), inner("RUNNING")])).toBe("run: running");
  expect(told([inner("STOPPING"), waits])).toBe("stopped: stopping");
  expect(told([inner("RUNNING", "Carol"), inner("RUNNING")], new Set(["David"]))).toBe(
    "unknown: unknown",
  );
  expect(told([inner("FINISHED"), inner("RUNNING")], false, true)).toBe("unknown: end not seen");
  expect(told([{ ...inner("RUNNING"), asks: true }, waits])).toBe("unknown: outcome not known");
  // Between two actions nothing runs.
  expect(told([inner("FINISHED"), waits])).toBe("idle: 1 of 2 inside ended");
  expect(told([inner("FINISHED"), inner("BYPASSED")])).toBe("done: 2 of 2 inside ended");
  const other = { graph: keyed("Pick", 1), names: [] };
  expect(progressInside({ ...run, actions: { Do_0: waits } }, false, other).size).toBe(0);
});
