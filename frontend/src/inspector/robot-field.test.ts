import { expect, test } from "vitest";
import { anyAction } from "../testing/graphs";
import { suggestedRobots } from "./robot-field";

test("robots of the graph are suggested first, then registered ones, each once, and no simulator", () => {
  const actions = ["Scout", "", "Carrier", "Scout"].map((actor, i) => ({
    ...anyAction(`a${i}`),
    actor,
  }));
  const engines = [
    { name: "simulator", simulated: true },
    { name: "David", simulated: false },
    { name: "Carrier", simulated: false },
  ];
  expect(suggestedRobots(actions, engines)).toEqual(["Carrier", "Scout", "David"]);
  expect(suggestedRobots([], [])).toEqual([]);
});
