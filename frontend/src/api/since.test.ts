/** Choice of the last run that went well. */
import { expect, test } from "vitest";
import { lastGoodRun } from "./history";
import type { Run } from "./runs";

const run = (number: number, part: Partial<Run> = {}): Run =>
  ({ number, version: `v${number}`, state: "finished", result: "on_true", ...part }) as Run;

test("the last run before that finished well counts, whatever the order of the list", () => {
  const runs = [run(3), run(1), run(5), run(4, { result: "on_error" }), run(2)];
  expect(lastGoodRun(runs, run(5))?.number).toBe(3);
});

test("a robot that tells no result is taken at its word that it finished", () => {
  expect(lastGoodRun([run(1, { result: null })])?.number).toBe(1);
});

test("what was stopped, is unknown or has no version went well nowhere", () => {
  const runs = [
    run(1, { state: "stopped" }),
    run(2, { state: "unknown" }),
    run(3, { version: null }),
  ];
  expect(lastGoodRun(runs)).toBeNull();
});
