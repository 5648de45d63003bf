import { expect, test } from "vitest";
import { rangeWords } from "./repeat-page";

test("a range spans the bounds of all runs, and has no upper end where one has none", () => {
  expect(rangeWords([])).toBe("");
  expect(rangeWords([null, { least: 1, most: 2 }, { least: 3, most: 4 }])).toBe("1.0–4.0 s");
  expect(
    rangeWords([
      { least: 1, most: null },
      { least: 3, most: 4 },
    ]),
  ).toBe("≥ 1.0 s");
});
