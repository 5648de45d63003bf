import { expect, test } from "vitest";
import type { CheckedCourses } from "../api/courses";
import type { Graph, Relation } from "../graph/model";
import { EMPTY_GRAPH } from "../graph/model";
import { arrowWords, isThere, untakenPlaces } from "./untaken-list";

const relation = (parent: string, child: string, listing = 0): Relation =>
  ({ parent, child, listing }) as Relation;
const action = (key: string, name: string) =>
  ({ key, name, instanceId: 0, missing: false }) as Graph["actions"][number];
const graph: Graph = {
  ...EMPTY_GRAPH,
  actions: [action("k0", "Dock"), action("k1", "Charge")],
  relations: [relation("k0", "k1"), relation("k0", "k1", 1), relation("k1", "exit")],
};
const found = {
  courses: [],
  coverage: {
    untaken: [
      { parent: "k0", child: "k1", outcome: "on_false" },
      { parent: "k0", child: "k1", outcome: "on_error" },
      { parent: "gone", child: "k1", outcome: "on_true" },
    ],
    unvisited: ["k1"],
  },
} as unknown as CheckedCourses;

test("an arrow has all outcomes that nothing takes, also where it is listed twice", () => {
  const { outcomes, actions } = untakenPlaces(graph, found);
  expect([...outcomes]).toEqual([
    ["k0>k1", ["on_false", "on_error"]],
    ["k0>k1;1", ["on_false", "on_error"]],
  ]);
  expect([...actions]).toEqual(["k1"]);
});

test("an arrow that is gone meanwhile is in no list", () => {
  const there = found.coverage.untaken.filter((arrow) => isThere(graph, arrow));
  expect(there.map((arrow) => arrowWords(graph, arrow))).toEqual([
    "Dock → Charge",
    "Dock → Charge",
  ]);
});
