import { expect, test } from "vitest";
import { ago, day, duration, instant, stopwatch } from "./times";

test("durations are as precise as they are short", () => {
  expect([400, 12_440, 72_000, 7_500_000].map(duration)).toEqual([
    "0.4 s",
    "12.4 s",
    "1:12",
    "2:05:00",
  ]);
  expect(stopwatch(42_900)).toBe("0:42");
});

test("the past is told in words that fit its distance", () => {
  const now = new Date(2026, 5, 17, 12, 0, 0).getTime();
  expect(ago(now - 1000, now)).toBe("just now");
  expect(ago(now - 12 * 60_000, now)).toBe("12 min ago");
  expect(day(now - 86_400_000, now)).toBe("yesterday");
});

test("what is no time is no time", () => {
  expect(instant("nonsense")).toBeNull();
  expect(instant(null)).toBeNull();
});
