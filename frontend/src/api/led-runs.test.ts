import { expect, test } from "vitest";
import { enginesOf, engineWords, isPieceOf } from "./led-runs";
import type { LiveState } from "./live-socket";
import { foreignGraphs } from "./live-socket";
import type { Run } from "./run-stop";
import { runPlace } from "./runs";

const run = (part: object) =>
  ({
    id: "r",
    number: 1,
    engine: "conducted",
    graph_name: "fetch",
    ended_at: null,
    ...part,
  }) as Run;
const led = run({ robots: { Scout: "David", Carrier: "Carol", "": "David" } });

test("a led run is named by its robots, each once, and never by its engine", () => {
  expect(enginesOf(led)).toEqual(["Carol", "David"]);
  expect(engineWords(led)).not.toContain("conducted");
  expect(runPlace(led)).toBe("Carol, David");
  expect(runPlace(run({ robots: { "": "simulator" }, simulated: true }))).toBe("simulator");
});

test("any other run, also one of an older runner, is named by its engine", () => {
  expect(enginesOf(run({ engine: "David", robots: null }))).toEqual(["David"]);
  expect(enginesOf(run({ engine: "David", robots: undefined }))).toEqual(["David"]);
});

test("an action that a led run has sent is not called started elsewhere, and others are", () => {
  expect(isPieceOf(led, "David", "fetch--Look_0")).toBe(true);
  const held = (graph: string) => ({ graph, active: true, run: "p", state: "RUNNING" });
  const robot = (name: string, graph: string) => ({ name, holds: [held(graph)] });
  const now = {
    runs: new Map([["r", led]]),
    engines: [
      robot("David", "fetch--Look_0"),
      robot("Carol", "fetch_more"),
      robot("Eve", "fetch--Look_0"),
    ],
  } as unknown as LiveState;
  expect(foreignGraphs(now).map((each) => each.robot.name)).toEqual(["Carol", "Eve"]);
});
