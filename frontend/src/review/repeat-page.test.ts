import { expect, test } from "vitest";
import { rangeWords } from "./repeat-page";

const ended = (least: number, most: number | null) => ({
  ended_at: "2026-11-30T08:00:00Z",
  took: { least, most },
});

test("a range spans the bounds of all runs, and has no upper end where one has none", () => {
  expect(rangeWords([])).toBe("");
  expect(rangeWords([null, ended(1, 2), ended(3, 4)])).toBe("1.0–4.0 s");
  expect(rangeWords([ended(1, null), ended(3, 4)])).toBe("≥ 1.0 s");
});

test("a run that goes on is no part of the range", () => {
  const running = { ended_at: null, took: { least: 0.3, most: null } };
  expect(rangeWords([ended(1, 2), running])).toBe("1.0–2.0 s");
});
