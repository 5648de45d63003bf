import { expect, test } from "vitest";
import type { Problem } from "../../api/graphs";
import { problemGroups } from "../../graph/problems/problem-groups";
import { problemMarksOf, problemMarkWords } from "./problem-marks";

const problem = (
  code: string,
  severity: Problem["severity"],
  where: Problem["where"],
): Problem => ({
  code,
  severity,
  where,
  message: `about ${code}`,
});

const marksOf = (problems: readonly Problem[]) =>
  problemMarksOf(problemGroups(problems, { actions: [], relations: [] }));

test("a problem of an arrow marks the arrow, one of an action its card, one of the graph nothing", () => {
  const marks = marksOf([
    problem("H2", "error", { relation: "a>b", aid: "a" }),
    problem("name-class", "warning", { aid: "b" }),
    problem("graph-name", "warning", {}),
  ]);
  expect([...marks.keys()]).toEqual(["a>b", "b"]);
});

test("a problem marks every place to which it refers", () => {
  const also = [{ relation: "b>c" }];
  const marks = marksOf([{ ...problem("H12", "warning", { relation: "a>b" }), also }]);
  expect([...marks.keys()]).toEqual(["a>b", "b>c"]);
});

test("a note that applies to nearly every graph marks no arrow", () => {
  const also = [{ relation: "b>c" }];
  const marks = marksOf([{ ...problem("H3", "warning", { relation: "a>b" }), also }]);
  expect([...marks.keys()]).toEqual([]);
});

test("a mark lists every reason with its code, errors first", () => {
  const mark = marksOf([
    problem("slow", "warning", { aid: "a" }),
    problem("type-empty", "error", { aid: "a" }),
    problem("H6", "error", { aid: "a" }),
  ]).get("a");
  expect(mark?.reasons).toBe("about H6 (H6)\nabout type-empty (type-empty)\nabout slow (slow)");
  expect(problemMarkWords(mark)).toBe(
    ". 1 wrong, 1 to fill in, 1 warning. about H6 (H6) about type-empty (type-empty) about slow (slow)",
  );
  expect(problemMarkWords(null)).toBe("");
});
