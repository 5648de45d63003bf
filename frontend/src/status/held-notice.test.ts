import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { heldWords, laterActions } from "./held-notice";

const held = { by: null, why: "Look_0 on David: the robot does not answer.", since: "2026-01-01" };
const run = (part: object) =>
  ({
    ...{ id: "r", number: 4, graph_name: "fetch", engine: "conducted", state: "running" },
    ...{ robots: { Scout: "David", Carrier: "Carol" }, held, ended_at: null, actions: {} },
    ...part,
  }) as unknown as Run;
const NONE: ReadonlySet<string> = new Set();
const action = (state: string, robot: string) => ({ state, robot, visits: [] });

test("a held run says what goes on all the same, and on which robot", () => {
  const actions = {
    Drive_0: action("RUNNING", "Carol"),
    Look_0: action("FINISHED", "David"),
    Beep_0: action("STOPPING", ""),
  };
  const words = heldWords(run({ actions }), NONE);
  expect(words?.why).toBe("Waiting: Look on David: the robot does not answer.");
  expect(words?.moving).toMatch(
    /^STILL MOVING: Drive.* on .?Carol.?\. Not over, and moves nothing: Beep.* on the simulator\.$/,
  );
  expect(words?.moving).not.toContain("Look");
});

test("what only the simulator plays is never said to move", () => {
  const moving = (robot: string) =>
    heldWords(run({ actions: { Beep_0: action("RUNNING", robot) } }), NONE)?.moving;
  for (const robot of ["", "simulator"])
    expect(moving(robot)).toMatch(/^Not over, and moves nothing/);
});

test("what a robot does that does not answer is not known, and may go on", () => {
  const actions = { Drive_0: action("RUNNING", "Carol"), Look_0: action("RUNNING", "David") };
  const words = heldWords(run({ actions }), new Set(["David"]));
  expect(words?.moving).toMatch(
    /^STILL MOVING: Drive.* on .?Carol.?\. Not known, .*: Look.* on .?David/,
  );
});

test("an action moves still until its rest is proven, also where it was seen to end", () => {
  const actions = { Lift_0: action("FINISHED", "David") };
  const words = (state: string) =>
    heldWords(run({ actions, rests: [{ robot: "David", state, action: "Lift_0" }] }), NONE)?.moving;
  expect(words("going")).toMatch(/^STILL MOVING: Lift.* on .?David.?\.$/);
  expect(words("proven")).toBe("No action was seen to move.");
});

test("it never says that nothing moves, only that nothing was seen to", () => {
  expect(heldWords(run({}), NONE)?.moving).toBe("No action was seen to move.");
});

test("a run that is not held, is being stopped or is over waits for nobody", () => {
  expect(heldWords(run({ held: null }), NONE)).toBeNull();
  expect(heldWords(run({ desired: "stopped" }), NONE)).toBeNull();
  expect(heldWords(run({ ended_at: "2026-01-01" }), NONE)).toBeNull();
});

test("a run can go on until an action that does not wait to begin already, and is none of a level", () => {
  const seen = { state: "UNINITIALIZED", robot: "David" };
  const actions = { Drive_0: seen, Grip_0: seen, Lift_0: seen, "task__Lift__0/Turn_0": seen };
  const next = [{ action: "Grip_0", robot: "David" }];
  expect(laterActions(run({ actions, held: { ...held, next } }))).toEqual(["Drive_0", "Lift_0"]);
  expect(laterActions(run({ actions: {} }))).toEqual([]);
});
