import { expect, test } from "vitest";
import type { Robot } from "../api/robots";
import { batonWords } from "./robot-rights";

const DAVID = { name: "David", baton: true, holder: null } as Robot;
const ANN = { id: "ann", name: "Ann" };
const HELD = { person: ANN, since: "2026-11-28T09:00:00Z", here: true, falls_at: null };

test("the baton of a robot is said in words for the person who reads them", () => {
  expect(batonWords({ ...DAVID, baton: false, holder: HELD }, "ann")).toBe("");
  expect(batonWords(DAVID, "ann")).toBe("Nobody has its baton");
  expect(batonWords({ ...DAVID, holder: HELD }, "ann")).toBe("You have its baton");
  expect(batonWords({ ...DAVID, holder: HELD }, "ben")).toContain("Ann");
  const gone = { ...HELD, here: false, falls_at: "2026-11-28T09:30:00Z" };
  expect(batonWords({ ...DAVID, holder: gone }, "ben")).toContain("no page open: it falls at");
});
