import { expect, test } from "vitest";
import type { LiveState } from "../api/live-socket";
import type { ActionRun, Run } from "../api/runs";
import { endUnknownSince, silentSinceOf } from "./silence";

const visit: ActionRun["visits"][number] = {
  from: "2026-01-01T00:00:01Z",
  not_before: "2026-01-01T00:00:00Z",
  not_after: null,
  until: null,
  result: null,
  how: "observed",
  inputs: null,
};

test("a lane is not known from when its robot became silent, and only while something moves there", () => {
  const since = "2026-01-01T00:00:05Z";
  const robot = { name: "David", simulated: false, state: "gone", since };
  const now = { link: "live", since: 0, engines: [robot] } as unknown as LiveState;
  const on = (robot: string, state = "RUNNING"): ActionRun => ({
    aid: "a",
    visits: [visit],
    older: 0,
    messages: [],
    state,
    robot,
  });
  expect(silentSinceOf(on("David"), now)).toBe(Date.parse(since));
  expect(silentSinceOf(on("Carol"), now)).toBeNull();
  expect(silentSinceOf(on("David", "FINISHED"), now)).toBeNull();
  const answers = { ...now, engines: [{ ...robot, state: "answering" }] } as unknown as LiveState;
  expect(silentSinceOf(on("David"), answers)).toBeNull();
  const untold = { ...now, engines: [{ ...robot, since: null }] } as unknown as LiveState;
  expect(silentSinceOf(on("David"), untold)).toBe(Date.parse(visit.from));
});

test("an action that a person is asked about is not known from when its robot or the run told so", () => {
  const asked = { visits: [visit], robot: "David", asks: true } as unknown as ActionRun;
  const run = (held: string | null, since?: string) =>
    ({ held: held && { since: held }, rests: [{ robot: "David", since }] }) as unknown as Run;
  const [early, late] = ["2026-01-01T00:00:04Z", "2026-01-01T00:00:05Z"];
  expect(endUnknownSince(asked, run(late, early))).toBe(Date.parse(early));
  expect(endUnknownSince(asked, run(late))).toBe(Date.parse(late));
  expect(endUnknownSince(asked, run(null))).toBe(Date.parse(visit.from));
  expect(endUnknownSince({ ...asked, asks: false }, run(late, early))).toBeNull();
});
