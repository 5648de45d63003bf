import { expect, test } from "vitest";
import type { HistoryEntry } from "../api/history";
import { doneWords, isWayBack, momentBefore, namesWords } from "./history-words";

const entry = (more: Partial<HistoryEntry>): HistoryEntry => ({
  kind: "edited",
  author: { id: "a", name: "Ada" },
  at: "2026-01-01T00:00:00Z",
  until: "2026-01-01T00:00:00Z",
  seq: 4,
  ...more,
});

test("an edit is compared with the moment before its first change", () => {
  expect(momentBefore(entry({ from_seq: 3 }))).toBe(2);
  expect(momentBefore(entry({ kind: "reverted", from_seq: 4 }))).toBe(3);
  expect(momentBefore(entry({ from_seq: 1 }))).toBeNull();
  expect(momentBefore(entry({ kind: "created", seq: 1 }))).toBeNull();
});

test("the moment on screen is no way back", () => {
  expect(isWayBack(entry({}), 4)).toBe(false);
  expect(isWayBack(entry({}), 5)).toBe(true);
  expect(doneWords(entry({ kind: "restored" }))).toBe("went back");
});

test("a merge names the draft and those who worked on it", () => {
  const people = ["Ben", "Mari"].map((name) => ({ id: name, name }));
  const merged = { draft: "d", name: "gentler grip", from_seq: 2, seq: 9, authors: people };
  const words = (source: string) =>
    doneWords(entry({ kind: "merged", merged: { ...merged, source } }));
  expect(words("d")).toBe("merged the draft “gentler grip” by Ben and Mari");
  expect(words("g")).toBe("took over what Ben and Mari did");
});

test("names are said as people say them", () => {
  const all = ["Ben", "Mari", "Ada", "Zoe"].map((name) => ({ id: name, name }));
  expect(namesWords([])).toBe("nobody");
  expect(namesWords(all.slice(0, 1))).toBe("Ben");
  expect(namesWords(all.slice(0, 3))).toBe("Ben, Mari and Ada");
  expect(namesWords(all)).toBe("Ben, Mari and 2 others");
  expect(namesWords([{ id: "x", name: "" }])).toBe("somebody");
});
