import { expect, test } from "vitest";
import { isListed } from "./log-levels";

test("lines below the chosen level are left out; of a line without a level nobody knows that", () => {
  const levels = ["debug", "info", "warn", "error", "fatal", ""] as const;
  expect(levels.filter((level) => isListed(level, "debug"))).toEqual([...levels]);
  expect(levels.filter((level) => isListed(level, "warn"))).toEqual(["warn", "error", "fatal", ""]);
  expect(isListed(undefined, "error")).toBe(true);
});
