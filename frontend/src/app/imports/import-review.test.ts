import { expect, test } from "vitest";
import type { Preview } from "../../api/graphs";
import { ImportReviews } from "./import-review";
import { dialectWords, isPlain } from "./take-files";

const preview = (part: Partial<Preview> = {}): Preview => ({
  dialect: "D1",
  notes: ["effect became type"],
  remarks: [],
  problems: [],
  name: "old",
  actions: 1,
  ...part,
});

test("a file of the present form without notes needs no look", () => {
  expect(isPlain(preview({ dialect: "D3", notes: [] }))).toBe(true);
  expect(isPlain(preview({ dialect: "D3" }))).toBe(false);
  expect(isPlain(preview({ notes: [] }))).toBe(false);
});

test("files are asked about one after the other, and each gets its own answer", async () => {
  const reviews = new ImportReviews();
  const first = reviews.ask("a.json", preview());
  const second = reviews.ask("b.json", preview());
  expect(reviews.now()?.file).toBe("a.json");
  reviews.now()?.answer(false);
  expect(reviews.now()?.file).toBe("b.json");
  reviews.now()?.answer(true);
  expect(reviews.now()).toBeNull();
  expect(await Promise.all([first, second])).toEqual([false, true]);
});

test("every dialect has words", () => {
  expect(dialectWords("D2")).toMatch(/earlier/);
  expect(dialectWords("D9")).toBe("another form");
});
