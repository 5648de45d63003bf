import { expect, test } from "vitest";
import type { ChangeMark } from "../canvas/marks/change-marks";
import { sideMarks } from "./side-by-side";

const mark = (change: ChangeMark["change"], values: Record<string, string> = {}): ChangeMark => ({
  ...{ change, by: "Ada", oldName: change === "changed" ? "Old" : null },
  oldValues: new Map(Object.entries(values)),
});
const marks = new Map([
  ["a", mark("added")],
  ["r", mark("removed")],
  ["c", mark("changed", { speed: "0.4" })],
]);

test("each side has what is on it, and both have what changed", () => {
  expect([...sideMarks(marks, "earlier").keys()]).toEqual(["r", "c"]);
  expect([...sideMarks(marks, "later").keys()]).toEqual(["a", "c"]);
});

test("what it was stands on the other side, and is not said twice", () => {
  const changed = sideMarks(marks, "later").get("c");
  expect([changed?.oldName, changed?.oldValues.size, [...(changed?.rows ?? [])]]).toEqual([
    null,
    0,
    ["speed"],
  ]);
});
