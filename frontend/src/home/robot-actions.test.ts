import { expect, test } from "vitest";
import { knowledgeOf, robotDifferences, robotTemplate } from "./robot-actions";

const move = {
  name: "Move",
  inputs: { "pose::x": "number", "pose::y": "number", fast: "bool" },
  outputs: { done: "bool" },
};

test("robots are grouped by what they have", () => {
  const told = [
    { robot: "atlas", indexed: { actions: [move], graphs: [], unread: 0 } },
    { robot: "birch", indexed: null },
  ];
  const known = knowledgeOf(told);
  expect(known.unknown).toEqual(["birch"]);
  expect(known.byName.get("Move")?.map(({ robot }) => robot)).toEqual(["atlas"]);
});

test("what a robot has is drawn with, groups and all", () => {
  expect(robotTemplate(move).inputs?.[0]).toEqual({
    path: "pose/x",
    text: '{"pvf_type":"number"}',
  });
});

test("what a robot has otherwise is told", () => {
  const own = {
    inputs: [
      { path: "pose/x", pvf_type: "number" },
      { path: "pose/y", pvf_type: "string" },
      { path: "grip", pvf_type: "number" },
    ],
    outputs: [],
  };
  expect(robotDifferences(own, move)).toEqual([
    "no grip",
    "pose.y is number",
    "fast besides",
    "output done besides",
  ]);
});
