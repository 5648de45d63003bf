import { expect, test } from "vitest";
import type { Note } from "../../graph/edit/notes";
import { notesAfter } from "./follow-notes";

const note = (key: string, kind: Note["kind"], at: Note["at"], size: Note["size"]): Note => ({
  ...{ key, kind, at, size },
  text: "",
  color: "blue",
});
const size = { width: 200, height: 100 };
const sizes = new Map([
  ["a", size],
  ["b", size],
  ["c", size],
]);
const before = new Map([
  ["a", [0, 0]],
  ["b", [0, 200]],
  ["c", [0, 400]],
] as const);
const after = new Map([
  ["a", [0, 0]],
  ["b", [300, 0]],
  ["c", [600, 0]],
] as const);

test("a frame surrounds its former contents with its former margins", () => {
  const frame = note("g/f", "frame", [-30, 170], [260, 370]);
  expect(notesAfter([frame], before, after, sizes, "right").get("g/f")).toEqual({
    at: [270, -30],
    size: [560, 170],
  });
});

test("a note moves along with the nearest card, and covers none", () => {
  const beside = note("g/n", "note", [240, 420], [180, 60]);
  expect(notesAfter([beside], before, after, sizes, "right").get("g/n")?.at).toEqual([840, 20]);
  const between = note("g/m", "note", [10, 110], [180, 60]);
  expect(notesAfter([between], before, after, sizes, "right").get("g/m")?.at[1]).toBeGreaterThan(
    100,
  );
});
