import { expect, test } from "vitest";
import type { ActionStatistics } from "../api/review";
import { failureWords, resultParts } from "./statistics-page";

const action = (more: Partial<ActionStatistics>) =>
  ({ visits: 9, at_least: false, results: {}, said: {}, unknown: 0, ...more }) as ActionStatistics;

test("results that persons gave by word stand apart from those that were seen", () => {
  const found = resultParts(
    action({ results: { true: 4, error: 1 }, said: { true: 2, false: 1 }, unknown: 1 }),
  );
  expect(found.map(({ result, count, said }) => [count, result, said])).toEqual([
    [4, "true", false],
    [1, "error", false],
    [2, "true", true],
    [1, "false", true],
    [1, "unknown", false],
  ]);
});

test("an action that failed by word is among those that fail, and that is told", () => {
  expect(failureWords(action({ results: { error: 2 } }))).toBe("2 of 9 visits");
  expect(failureWords(action({ results: { error: 2 }, said: { false: 1, true: 3 } }))).toBe(
    "3 of 9 visits, 1 of these by word",
  );
});
