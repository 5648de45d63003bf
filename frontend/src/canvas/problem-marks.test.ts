import { expect, test } from "vitest";
import type { Problem } from "../api/graphs";
import { countWords, problemMarksOf, problemMarkWords } from "./problem-marks";

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

test("a problem of an arrow marks the arrow, one of an action its card, one of the graph nothing", () => {
  const marks = problemMarksOf([
    problem("H2", "error", { relation: "a>b", aid: "a" }),
    problem("name-class", "warning", { aid: "b" }),
    problem("graph-name", "warning", {}),
  ]);
  expect([...marks.keys()]).toEqual(["a>b", "b"]);
});

test("a mark names every reason, the errors first", () => {
  const mark = problemMarksOf([
    problem("slow", "warning", { aid: "a" }),
    problem("H6", "error", { aid: "a" }),
  ]).get("a");
  expect(mark?.reasons).toBe("H6: about H6\nslow: about slow");
  expect(mark && countWords(mark)).toBe("1 error, 1 warning");
  expect(problemMarkWords(mark)).toBe(". 1 error, 1 warning. H6: about H6 slow: about slow");
  expect(problemMarkWords(null)).toBe("");
});
