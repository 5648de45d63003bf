import { expect, test } from "vitest";
import { pastOf, withPast } from "./past-links";

test("an address leads to a moment, and to what it is compared with", () => {
  expect(pastOf("?at=12")).toEqual({ at: 12, with: "own" });
  expect(pastOf("?at=12&with=now")).toEqual({ at: 12, with: "now" });
  expect(pastOf("?at=12&with=7")).toEqual({ at: 12, with: 7 });
  for (const odd of ["", "?at=0", "?at=x", "?at=1e3"]) expect(pastOf(odd)).toBeNull();
  expect(pastOf("?at=12&with=<b>")?.with).toBe("own");
});

test("what else an address says stays", () => {
  expect(withPast("?action=a1&at=3&with=now", { at: 5, with: "own" })).toBe("?action=a1&at=5");
  expect(withPast("?at=3", null)).toBe("");
  expect(pastOf(withPast("", { at: 9, with: 4 }))).toEqual({ at: 9, with: 4 });
});
