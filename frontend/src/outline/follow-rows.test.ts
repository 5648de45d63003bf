import { expect, test } from "vitest";
import type { Progress } from "../status/progress";
import { latestRunning } from "./follow-rows";

const at = (tone: Progress["tone"], since: number | null) => ({ tone, since }) as Progress;

test("of the actions that run the one that began last is followed", () => {
  expect(latestRunning(new Map())).toBeNull();
  const progress = new Map([
    ["a", at("true", null)],
    ["b", at("run", 2_000)],
    ["c", at("run", 3_000)],
    ["d", at("run", null)],
    ["e", at("unknown", 9_000)],
  ]);
  expect(latestRunning(progress)).toBe("c");
});
