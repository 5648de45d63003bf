import { expect, test } from "vitest";
import type { HistoryEntry } from "../../api/documents/history";
import { momentsOf, momentWords } from "./compared";

const noon = new Date(2026, 10, 23, 12, 5).toISOString();
const entries: HistoryEntry[] = [
  {
    kind: "edited",
    author: { id: "ada", name: "Ada" },
    ...{ at: noon, until: noon, from_seq: 5, seq: 9 },
  },
];

test("by default with the beginning of the sitting", () => {
  expect(momentsOf({ at: 9, with: "own" }, entries, 12)).toEqual({ from: 4, to: 9 });
  expect(momentsOf({ at: 7, with: "own" }, entries, 12)).toEqual({ from: 4, to: 7 });
  expect(momentsOf({ at: 3, with: "own" }, entries, 12)).toEqual({ from: null, to: 3 });
});

test("with now, with another moment, and with nothing: the later one is drawn", () => {
  expect(momentsOf({ at: 9, with: "now" }, entries, 12)).toEqual({ from: 9, to: 12 });
  expect(momentsOf({ at: 3, with: 9 }, entries, 12)).toEqual({ from: 3, to: 9 });
  expect(momentsOf({ at: 9, with: 3 }, entries, 12)).toEqual({ from: 3, to: 9 });
  expect(momentsOf({ at: 9, with: 9 }, entries, 12)).toEqual({ from: null, to: 9 });
  expect(momentsOf({ at: 9, with: "nothing" }, entries, 12)).toEqual({ from: null, to: 9 });
});

test("a moment is called by whose sitting it is of", () => {
  expect(momentWords(entries, 6, Date.parse(noon))).toBe("Ada · today 12:05");
  expect(momentWords(entries, 2, Date.parse(noon))).toBe("change 2");
});
