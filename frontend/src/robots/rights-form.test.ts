import { expect, test } from "vitest";
import { endOfDay, lastDay } from "./rights-form";

test("a right lasts until the end of its last day, and that day is shown again", () => {
  for (const day of ["2026-11-28", "2026-12-31", "2027-02-28", "2028-02-29", "2027-03-28"]) {
    const until = endOfDay(day);
    expect(lastDay(until)).toBe(day);
    const end = new Date(until ?? "");
    expect([end.getHours(), end.getMinutes()]).toEqual([0, 0]);
  }
  expect([endOfDay(""), lastDay(null)]).toEqual([null, ""]);
});
