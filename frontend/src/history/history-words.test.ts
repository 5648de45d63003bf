import { expect, test } from "vitest";
import type { HistoryEntry } from "../api/documents/history";
import { doneWords, isWayBack, momentBefore } from "./history-words";

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
