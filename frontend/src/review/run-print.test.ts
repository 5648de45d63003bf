import { expect, test } from "vitest";
import { rangeText } from "./run-print";

const at = (seconds: number) => new Date(2026, 10, 22, 12, 0, seconds).toISOString();

test("times on paper are as wide as what is known of them", () => {
  expect(rangeText(at(1), at(1))).toBe("12:00:01.0");
  expect(rangeText(at(1), at(3))).toBe("12:00:01.0–12:00:03.0");
  expect(rangeText(at(1), null)).toBe("after 12:00:01.0");
  expect(rangeText(null, at(3))).toBe("by 12:00:03.0");
  expect(rangeText(null, null)).toBe("not known");
});
