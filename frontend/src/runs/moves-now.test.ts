import { expect, test } from "vitest";
import type { LiveState } from "../api/live-socket";
import type { Run } from "../api/runs";
import { movesNow } from "./moves-now";

const action = (state: string, how = "observed") => ({
  aid: "a",
  state,
  visits: [{ how }],
  older: 0,
  messages: [],
});

const run = (part: Partial<Run>) =>
  ({
    id: "r",
    number: 1,
    engine: "atlas",
    graph_name: "Round",
    simulated: false,
    state: "running",
    ended_at: null,
    unknown_since: null,
    actions: {},
    ...part,
  }) as unknown as Run;

const live = (runs: Run[], link: LiveState["link"] = "live"): LiveState => ({
  asked: [],
  link,
  since: 0,
  engines: [],
  runs: new Map(runs.map((each) => [each.id, each])),
  stops: [],
});

const actions = (all: Record<string, ReturnType<typeof action>>) =>
  all as unknown as Run["actions"];

test("what runs is named by robot, and what was only concluded is marked", () => {
  const birch = run({
    id: "b",
    engine: "birch",
    actions: actions({ Hold_2: action("RUNNING", "inferred") }),
  });
  const atlas = run({
    actions: actions({ Drive_0: action("RUNNING"), Open_0: action("FINISHED") }),
  });
  expect(movesNow(live([birch, atlas])).map(({ robot, words }) => `${robot}: ${words}`)).toEqual([
    "atlas: Drive",
    "birch: Hold 2 (inferred)",
  ]);
});

test("a run in the simulator moves nothing, so the bar keeps its words", () => {
  const simulated = run({ simulated: true, engine: "simulator" });
  expect(movesNow(live([simulated, run({})])).map(({ robot }) => robot)).toEqual(["atlas"]);
});

test("what runs inside of an action is named by the way to it, as people call it", () => {
  const inner = { ...action("RUNNING"), aid: null as unknown as string };
  const round = run({
    actions: actions({
      Fetch_0: action("RUNNING"),
      Wait_0: action("RUNNING"),
      "Round__Fetch__0/Grip_0": inner,
      "Round__Fetch__0__Grip__0/Close_1": inner,
      "Round__Fetch__0/Lift_0": { ...inner, state: "FINISHED" },
    }),
  });
  expect(movesNow(live([round]))[0]?.words).toBe("Wait, Fetch › Grip › Close 1");
});

test("of a robot that is not heard nothing is said to move, and nothing to rest", () => {
  const moving = actions({ Drive_0: action("RUNNING") });
  const silent = run({ state: "unknown", unknown_since: "1970-01-01T00:00:01Z", actions: moving });
  expect(movesNow(live([silent]))).toMatchObject([{ kind: "unknown", words: "not known" }]);
  for (const link of ["down", "connecting"] as const) {
    expect(movesNow(live([run({ actions: moving })], link))).toMatchObject([
      { kind: "unknown", words: "not known" },
    ]);
  }
});

test("a stop under way is no rest, and a run that has ended is no longer told", () => {
  expect(movesNow(live([run({ state: "stopping" })]))).toMatchObject([
    { kind: "unknown", words: "stopping, rest not proven" },
  ]);
  expect(movesNow(live([run({ state: "finished", ended_at: "t" })]))).toEqual([]);
});

test("a led run is told robot by robot; a robot that nothing was begun on waits", () => {
  const played = (state: string, robot: string) => ({ ...action(state), robot });
  const led = run({
    engine: "conducted",
    robots: { Scout: "David", Carrier: "Carol", Bell: "simulator" },
    actions: actions({
      Drive_0: played("RUNNING", "Carol"),
      Look_0: played("UNINITIALIZED", "David"),
      Ring_0: action("RUNNING"),
    }),
  });
  expect(movesNow(live([led])).map(({ robot, kind, words }) => [robot, kind, words])).toEqual([
    ["Carol", "moves", "Drive"],
    ["David", "still", "waits"],
    ["simulator", "moves", "Ring"],
  ]);
});

test("of a robot of a led run that does not answer nothing is said to move", () => {
  const played = (robot: string) => ({ ...action("RUNNING"), robot });
  const led = run({
    engine: "conducted",
    robots: { Scout: "David", Carrier: "Carol" },
    actions: actions({ Drive_0: played("Carol"), Look_0: played("David") }),
  });
  const engine = (name: string, state: string) => ({ name, state, simulated: false, holds: [] });
  const engines = [engine("Carol", "answering"), engine("David", "silent")];
  const now = { ...live([led]), engines } as unknown as LiveState;
  expect(movesNow(now).map(({ robot, kind }) => [robot, kind])).toEqual([
    ["Carol", "moves"],
    ["David", "unknown"],
  ]);
});

test("of a led run that is stopped, a robot that is proven at rest is told apart from the others", () => {
  const led = run({
    robots: { a: "Carol", b: "David" },
    state: "stopping",
    desired: "stopped",
    rests: [
      { robot: "Carol", state: "proven", since: "1970-01-01T00:00:01Z" },
      { robot: "David", state: "stopping", stops: true },
    ],
  });
  const [carol, david] = movesNow(live([led]));
  expect(carol).toMatchObject({ robot: "Carol", kind: "still" });
  expect(carol?.words).toMatch(/^proven at rest/);
  expect(david).toMatchObject({ robot: "David", kind: "unknown" });
  expect(movesNow(live([led], "down"))).toMatchObject([{ kind: "unknown" }, { kind: "unknown" }]);
});

test("what a robot ran when it last answered is not said to move while it does not answer", () => {
  const held = { graph: "patrol", state: "RUNNING", active: true, run: null, stopping: null };
  const on = (state: string) => {
    const robot = { name: "David", simulated: false, state, holds: [held] };
    return { ...live([]), engines: [robot] } as unknown as LiveState;
  };
  expect(movesNow(on("answering"))).toMatchObject([
    { kind: "moves", words: "patrol, not started here" },
  ]);
  expect(movesNow(on("busy"))).toMatchObject([
    { kind: "unknown", words: "not known, ran patrol when it last answered" },
  ]);
});

test("of a hidden run nothing is said to rest or to move, and its pieces are not foreign", () => {
  const graph_name = "a graph that you may not see";
  const hidden = run({ hidden: true, graph_name, robots: { atlas: "atlas" } });
  const held = { graph: graph_name, state: "RUNNING", active: true, run: "r.1", stopping: null };
  const engines = [{ name: "atlas", state: "answering", simulated: false, holds: [held] }];
  const now = { ...live([hidden]), engines: engines as unknown as LiveState["engines"] };
  expect(movesNow(now)).toEqual([{ robot: "atlas", run: "r", kind: "unknown", words: graph_name }]);
});
