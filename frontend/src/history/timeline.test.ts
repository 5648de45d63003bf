import { expect, test } from "vitest";
import type { HistoryEntry } from "../api/history";
import type { ListedRun } from "../api/review";
import { daysOf, entryAt, joined, nextPage, timelineOf } from "./timeline";

const time = (minute: number) => new Date(2026, 10, 23, 12, minute).toISOString();
const edit = (author: string, from_seq: number, seq: number): HistoryEntry => ({
  kind: "edited",
  author: { id: author, name: author },
  at: time(from_seq),
  until: time(seq),
  from_seq,
  seq,
});
const version = (seq: number, minute: number): HistoryEntry => ({
  ...edit("ada", 0, seq),
  kind: "published",
  from_seq: undefined as never,
  at: time(minute),
  until: time(minute),
});

test("an entry that is cut where a page ends is told once", () => {
  const pages = [
    [edit("ada", 8, 20), edit("mari", 10, 18)],
    [edit("ada", 8, 17), edit("hella", 9, 12), edit("ada", 2, 5)],
  ];
  expect(joined(pages).map(({ author, seq }) => `${author.id} ${seq}`)).toEqual([
    "ada 20",
    "mari 18",
    "hella 12",
    "ada 5",
  ]);
});

test("the next page begins at the last edit, whatever versions tell", () => {
  expect(nextPage([edit("ada", 8, 20), { ...version(3, 21) }], 2)).toBe(20);
  expect(nextPage([edit("ada", 8, 20)], 2)).toBeNull();
});

test("runs stand between what people did; older ones wait for the rest of the list", () => {
  const run = (number: number, minute: number) =>
    ({ number, started_at: time(minute), requested_at: time(minute) }) as ListedRun;
  const entries = [edit("ada", 8, 20), edit("ada", 4, 6)];
  const kinds = (whole: boolean) =>
    timelineOf(entries, [run(2, 10), run(1, 3)], whole).map((item) =>
      item.kind === "run" ? item.run.number : "edit",
    );
  expect(kinds(false)).toEqual(["edit", 2, "edit"]);
  expect(kinds(true)).toEqual(["edit", 2, "edit", 1]);
});

test("days are those of the reader", () => {
  const late = { ...edit("ada", 1, 2), until: new Date(2026, 10, 24, 0, 1).toISOString() };
  const days = daysOf(timelineOf([late, edit("ada", 1, 2)], [], true));
  expect(days.map(({ items }) => items.length)).toEqual([1, 1]);
});

test("a change belongs to the sitting that it ends, else to one that goes on", () => {
  const entries = [edit("mari", 10, 20), edit("ada", 5, 12)];
  expect(entryAt(entries, 12)?.author.id).toBe("ada");
  expect(entryAt(entries, 15)?.author.id).toBe("mari");
  expect(entryAt(entries, 3)).toBeNull();
});
