import { expect, test } from "vitest";
import type { Problem } from "../api/graphs";
import { problemGroups } from "../graph/problems/problem-groups";
import { marksInside } from "./level-frame";

const inside = (aids: string[], aid?: string): Problem => ({
  code: "subgraph",
  severity: "error",
  where: { aid: aids[0] ?? "" },
  message: `at ${aids.join(" ")} ${aid}`,
  inside: {
    ...{ levels: aids.map((each) => `${each}_0`), aids, graph: "G" },
    ...{ code: "H2", message: "about it", where: aid === undefined ? {} : { aid } },
  },
});

const marksOf = (...problems: Problem[]) =>
  marksInside(problemGroups(problems, { actions: [], relations: [] }));

test("a problem in an inner graph marks its card and each level above it, except the outermost", () => {
  const marks = marksOf(inside(["a", "b"], "c"), inside(["a", "b"]), inside(["a"], "d"));
  const wrong = [...marks].map(([path, mark]) => [path, mark.wrong]);
  expect(wrong).toEqual([
    ["a/b", 2],
    ["a/b/c", 1],
    ["a/d", 1],
  ]);
  expect(marks.get("a/d")?.reasons).toBe("about it (H2)");
});

test("a problem of the graph itself marks no inner card", () => {
  const { inside: _, ...own } = inside(["a"], "d");
  expect(marksOf(own).size).toBe(0);
});
