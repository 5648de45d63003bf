import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import type { Run } from "../../api/runs";
import { mapsOf } from "../../graph/document-keys";
import { addAction, connect } from "../../graph/edit";
import { readGraph } from "../../graph/read";
import { heldHeight, usualHeight } from "./run-drawer";
import { allWords, robotTabs } from "./shown-run";
import { valuesOf, valueText } from "./values-panel";

const iso = (s: number) => new Date(s * 1000).toISOString();
const visit = (from: number, until: number | null, result: string | null = null) => ({
  from: iso(from),
  not_before: iso(from),
  until: until === null ? null : iso(until),
  not_after: until === null ? null : iso(until),
  result,
  how: "observed",
  inputs: null,
});
const action = (aid: string, state: string, visits: object[] = []) => ({
  aid,
  state,
  visits,
  older: 0,
  messages: [],
});
const run = (part: object) =>
  ({
    id: "r",
    graph_name: "round",
    engine: "atlas",
    simulated: false,
    state: "running",
    started_at: iso(0),
    ended_at: null,
    alarms: [],
    actions: {},
    ...part,
  }) as unknown as Run;
const lane = (name: string, robot: string) => ({
  ...{ name, label: name, aid: name, robot },
  ...{ levels: [], around: null, holds: false },
});

test("each run that goes on has a tab, with what moves on its robot; silence is not known", () => {
  const atlas = run({ actions: { Drive_0: action("d", "RUNNING", [visit(0, null)]) } });
  const birch = run({ id: "b", engine: "birch", state: "unknown", unknown_since: iso(1) });
  const tabs = robotTabs([atlas, birch], [lane("Drive_0", "")], false);
  expect(tabs.map(({ robot, words, tone }) => [robot, words, tone])).toEqual([
    ["atlas", "Drive", "run"],
    ["birch", "not known", "unknown"],
  ]);
  expect(allWords(tabs)).toBe("Both robots");
  expect(robotTabs([atlas], [lane("Drive_0", "")], true)[0]?.words).toBe("not known");
});

test("several robots in one run have a tab each, with their own actions", () => {
  const actions = {
    Drive_0: action("d", "RUNNING", [visit(0, null)]),
    Hold_0: action("h", "UNINITIALIZED"),
  };
  const lanes = [lane("Drive_0", "atlas"), lane("Hold_0", "birch")];
  const tabs = robotTabs([run({ actions })], lanes, false);
  expect(tabs.map(({ actor, words }) => [actor, words])).toEqual([
    ["atlas", "Drive"],
    ["birch", "waits"],
  ]);
});

test("while a run is stopped none of its robots is said to wait", () => {
  const actions = {
    Drive_0: action("d", "STOPPING", [visit(0, null)]),
    Hold_0: action("h", "UNINITIALIZED"),
  };
  const lanes = [lane("Drive_0", "atlas"), lane("Hold_0", "birch")];
  const said = (part: object) =>
    robotTabs([run({ actions, state: "stopping", ...part })], lanes, false).map(
      ({ words }) => words,
    );
  expect(said({})).toEqual(["stopping", "stopping"]);
  expect(said({ unconfirmed: "why" })).toEqual(["stop unconfirmed", "stop unconfirmed"]);
  const rests = [{ robot: "birch", state: "proven" }];
  expect(said({ desired: "stopped", rests })).toEqual(["stopping", "at rest"]);
  const seen = [{ robot: "atlas", state: "seen" }, ...rests];
  expect(said({ desired: "stopped", rests: seen })).toEqual(["seen at rest", "at rest"]);
});

test("of a run that is over each robot has the end of its own last action", () => {
  const actions = {
    Drive_0: action("d", "FINISHED", [visit(0, 1, "true")]),
    Look_0: action("l", "FINISHED", [visit(1, 2, "stopped")]),
    Grip_0: action("g", "FINISHED", [visit(0, 1, "false")]),
    Hold_0: action("h", "UNINITIALIZED"),
    Wave_0: action("w", "RUNNING", [visit(1, null)]),
    Skip_0: action("s", "BYPASSED"),
  };
  const first = { Drive: "atlas", Look: "atlas", Grip: "birch", Hold: "cedar" };
  const of = { ...first, Wave: "people", Skip: "elm" };
  const lanes = Object.entries(of).map(([name, robot]) => lane(`${name}_0`, robot));
  const over = run({ actions, state: "error", result: "on_error", ended_at: iso(3) });
  expect(robotTabs([over], lanes, false).map(({ words }) => words)).toEqual([
    "stopped",
    "false",
    "did not run",
    "end not seen",
    "passed over",
  ]);
});

test("values say whether they were seen or only sent, and what an action began after", () => {
  const doc = new Y.Doc();
  const look = addAction(doc, { name: "Look" });
  const grip = addAction(doc, { name: "Grip" });
  connect(doc, look, grip);
  const graph = readGraph(mapsOf(doc));
  const actions = {
    Look_0: action(look, "FINISHED", [visit(0, 2, "true")]),
    Grip_0: action(grip, "RUNNING", [{ ...visit(2, null), inputs: { force: "5" } }]),
  };
  const found = valuesOf(run({ actions }), graph, grip, { Grip_0: { force: "4" } });
  expect(found?.values).toEqual([{ name: "force", text: "5", from: "ran" }]);
  expect(found?.after).toEqual([{ name: "Look_0", result: "true", at: 2_000 }]);
  const [seen] = actions.Look_0.visits;
  const bounded = { ...actions, Look_0: action(look, "FINISHED", [{ ...seen, not_after: null }]) };
  expect(valuesOf(run({ actions: bounded }), graph, grip, undefined)?.after).toEqual([
    { name: "Look_0", result: "true", at: null },
  ]);
  const sent = valuesOf(run({ actions }), graph, look, { Look_0: { place: '"door"' } });
  expect(sent?.values).toEqual([{ name: "place", text: '"door"', from: "sent" }]);
  expect(valueText('{"pvf_type":"number","pvf_value":3}')).toBe("3");
});

test("a drawer leaves room for the canvas, whatever height was kept on a larger screen", () => {
  fc.assert(
    fc.property(
      fc.integer({ min: -500, max: 3_000 }),
      fc.integer({ min: 400, max: 2_000 }),
      (h, room) => {
        const held = heldHeight(h, room);
        expect(held).toBeGreaterThanOrEqual(96);
        expect(held).toBeLessThanOrEqual(Math.max(96, room * 0.7 + 1));
      },
    ),
  );
  expect(usualHeight(768)).toBeLessThan(220);
});
