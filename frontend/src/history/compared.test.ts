import { expect, test } from "vitest";
import type { HistoryEntry } from "../api/history";
import { momentsOf, momentWords } from "./compared";

const noon = new Date(2026, 10, 23, 12, 5).toISOString();
const entries: HistoryEntry[] = [
  {
    kind: "edited",
    author: { id: "ada", name: "Ada" },
    ...{ at: noon, until: noon, from_seq: 5, seq: 9 },
  },
];
const goods = [
  { run: 3, seq: 4 },
  { run: 8, seq: 7 },
];
const known = { entries, goods, runs: new Map([["r8", 7]]) };

test("by default with the beginning of the sitting", () => {
  expect(momentsOf({ at: 9, with: "own" }, known, 12)).toEqual({ from: 4, to: 9 });
  expect(momentsOf({ at: 7, with: "own" }, known, 12)).toEqual({ from: 4, to: 7 });
  expect(momentsOf({ at: 3, with: "own" }, known, 12)).toEqual({ from: null, to: 3 });
});

test("with now, with another moment, and with nothing: the later one is drawn", () => {
  expect(momentsOf({ at: 9, with: "now" }, known, 12)).toEqual({ from: 9, to: 12 });
  expect(momentsOf({ at: 3, with: 9 }, known, 12)).toEqual({ from: 3, to: 9 });
  expect(momentsOf({ at: 9, with: 3 }, known, 12)).toEqual({ from: 3, to: 9 });
  expect(momentsOf({ at: 9, with: 9 }, known, 12)).toEqual({ from: null, to: 9 });
  expect(momentsOf({ at: 9, with: "nothing" }, known, 12)).toEqual({ from: null, to: 9 });
});

test("with the last good run before it, and without one with the beginning of the sitting", () => {
  expect(momentsOf({ at: 9, with: "good" }, known, 12)).toEqual({ from: 7, to: 9 });
  expect(momentsOf({ at: 7, with: "good" }, known, 12)).toEqual({ from: 4, to: 7 });
  const none = { ...known, goods: [] };
  expect(momentsOf({ at: 9, with: "good" }, none, 12)).toEqual({ from: 4, to: 9 });
});

test("with what a run was started with, where that is a version of the graph", () => {
  expect(momentsOf({ at: 9, with: "run/r8" }, known, 12)).toEqual({ from: 7, to: 9 });
  expect(momentsOf({ at: 9, with: "run/r9" }, known, 12)).toEqual({ from: null, to: 9 });
});

test("a moment is called by whose sitting it is of", () => {
  expect(momentWords(entries, 6, Date.parse(noon))).toBe("Ada · today 12:05");
  expect(momentWords(entries, 2, Date.parse(noon))).toBe("change 2");
});
