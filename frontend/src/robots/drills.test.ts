import { expect, test } from "vitest";
import type { ListedRun } from "../api/review";
import type { Drill, Robot } from "../api/robots";
import { drillRuns } from "./drill-form";
import { drillWords } from "./drills";

const NOW = Date.parse("2026-11-28T12:00:00Z");
const run = (id: string, more: object) =>
  ({
    id,
    engine: "David",
    simulated: false,
    stopped_by: { id: "a", name: "Ada" },
    requested_at: "2026-11-28T11:00:00Z",
    ...more,
  }) as unknown as ListedRun;

test("a drill is recorded with a run there that was stopped within a day, once", () => {
  const robot = { name: "David", drills: [{ run: "known" }] } as unknown as Robot;
  const runs = [
    run("good", {}),
    run("known", {}),
    run("elsewhere", { engine: "Carol" }),
    run("simulated", { simulated: true }),
    run("not stopped", { stopped_by: null }),
    run("old", { requested_at: "2026-11-27T11:59:00Z" }),
  ];
  expect(drillRuns(runs, robot, NOW).map(({ id }) => id)).toEqual(["good"]);
});

test("a drill is called passed only without a failure", () => {
  const passed = { proof_ms: 484, failure: "" } as Drill;
  expect(drillWords(passed)).toBe("passed: rest proven after 0.48 s");
  const failed = { proof_ms: null, failure: "its Stop was not proven" } as Drill;
  expect(drillWords(failed)).toBe("failed: its Stop was not proven");
});
