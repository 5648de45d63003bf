/** Ways through the graphs of a run, in addresses and back. */
import fc from "fast-check";
import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { addressed, graphsOn, levelsAsked, sentLevels } from "./levels";

const action = (name: string, aid: string) => ({
  name,
  instance_id: 0,
  gui_attributes: { action_assistant: { aid } },
});
const umrf = (graph_name: string, ...actions: object[]) => ({ graph_name, actions });
const inside = (name: string, graph: string | null, ...actions: object[]) => ({
  ...{ name, graph, version: null, digest: "" },
  umrf: umrf(name, ...actions),
});
const run = {
  graph: "g1",
  graph_name: "Tour",
  umrf: umrf("Tour", action("Round", "k1"), action("Wave", "k2")),
  subgraphs: [
    inside("Round", "g2", action("Lap", "k1"), action("Grip", "k2")),
    inside("Lap", null, action("Grip", "k1")),
  ],
} as unknown as Run;
const sent = sentLevels(run);

const searchOf = (levels: readonly string[]) =>
  `?${new URLSearchParams(addressed(sent, levels).map((each) => ["in", `${each.graph}~${each.action}`]))}`;

test("an address leads to the level that it was made of", () => {
  for (const levels of [[], ["Round_0"], ["Round_0", "Lap_0"]]) {
    expect(levelsAsked(sent, searchOf(levels))).toEqual(levels);
    expect(graphsOn(sent, levels)).toHaveLength(levels.length + 1);
  }
  expect(graphsOn(sent, ["Round_0", "Lap_0"])?.map(({ id }) => id)).toEqual(["g1", "g2", null]);
});

test("what was not sent along is entered by no address", () => {
  expect(graphsOn(sent, ["Wave_0"])).toBeNull();
  expect(levelsAsked(sent, "?in=g1~k2")).toEqual([]);
  expect(levelsAsked(sent, "?in=g1~k1&in=g2~k2")).toEqual(["Round_0"]);
  fc.assert(fc.property(fc.string(), (text) => levelsAsked(sent, text).length >= 0));
});
