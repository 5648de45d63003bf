/** Durations are shown no more exactly than they were observed. */
import fc from "fast-check";
import { expect, test } from "vitest";
import { boundsText, durationText } from "./durations";

test.each([
  [null, null, null],
  [0, null, null],
  [1_500, null, "1.5 s"],
  [0, 1_500, "≤ 1.5 s"],
  [3_000, 3_900, "3.0–3.9 s"],
  [2_960, 3_910, "2.9–4.0 s"],
  [3_020, 3_060, "3.0–3.1 s"],
  [93_000, 93_600, "1:33–1:34"],
  [59_000, 61_000, "59.0 s–1:01"],
  [5_000, Number.POSITIVE_INFINITY, "≥ 5.0 s"],
  [0, Number.POSITIVE_INFINITY, null],
])("%s ms, %s at most: %s", (took, atMost, words) => {
  expect(durationText({ took, atMost })).toBe(words);
});

const seconds = (words: string) => Number(words.replace(" s", ""));

test("no range is told narrower than it is", () => {
  const ms = fc.integer({ min: 0, max: 59_000 });
  fc.assert(
    fc.property(ms, fc.integer({ min: 2, max: 900 }), (least, more) => {
      const words = boundsText({ least: least / 1000, most: (least + more) / 1000 }) ?? "";
      const [from, to] = words.startsWith("≤ ") ? ["0", words.slice(2)] : words.split("–");
      expect(seconds(from ?? "") * 1000).toBeLessThanOrEqual(least + 1e-6);
      expect(seconds(to ?? "") * 1000).toBeGreaterThanOrEqual(least + more - 1e-6);
    }),
  );
});
