import { expect, test } from "vitest";
import { EMPTY_GRAPH, ENGINE_DEFAULTS, type Graph, type Relation } from "../graph/model";
import { anyAction } from "../testing/graphs";
import { alignedWith } from "./compared";
import { changesBetween } from "./graph-difference";

const value = (text: string) => ({ path: "speed", text });
const arrow = (parent: string, child: string): Relation => ({
  ...{ parent, child, listing: 0, conditions: ENGINE_DEFAULTS, required: true, remap: [] },
  ...{ only: null, parentOrder: 0, childOrder: 0, parentsExtra: [], childrenExtra: [] },
  waypoints: [],
});
const drawn: Graph = {
  ...EMPTY_GRAPH,
  name: "valves",
  actions: [
    { ...anyAction("aaaaaaaaaaaa", [value('{"pvf_value": 5.0}')]), name: "Drive" },
    { ...anyAction("bbbbbbbbbbbb"), name: "Cool", extra: [["x", "1"]] },
  ],
  relations: [{ ...arrow("aaaaaaaaaaaa", "bbbbbbbbbbbb"), parentOrder: 7 }],
  notes: [["n", "{}"]],
};
const sent = (first: string, speed: string): Graph => ({
  ...EMPTY_GRAPH,
  actions: [
    { ...anyAction(first, [value(`{"pvf_value":${speed}}`)]), name: "Drive" },
    { ...anyAction("bbbbbbbbbbbb"), name: "Cool" },
  ],
  relations: [arrow(first, "bbbbbbbbbbbb")],
});
const changes = (graph: Graph) =>
  changesBetween(alignedWith(graph, drawn), drawn, () => null).things.filter((each) => !each.looks);

test("what was sent and says the same does not differ, however it is spelled", () => {
  expect(changes(sent("aaaaaaaaaaaa", "5"))).toEqual([]);
});

test("actions that nobody here drew are known by their names", () => {
  expect(changes(sent("Drive_0", "5"))).toEqual([]);
  const [found, ...others] = changes(sent("Drive_0", "7"));
  expect([found?.key, found?.change, others.length]).toEqual(["aaaaaaaaaaaa", "changed", 0]);
});
