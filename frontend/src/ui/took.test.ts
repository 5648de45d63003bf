/** How long something took is told no more exactly than it was seen. */
import { expect, test } from "vitest";
import { tookWords } from "./took";

test.each([
  [null, null, null],
  [0, null, null],
  [1_500, null, "1.5 s"],
  [0, 1_500, "≤ 1.5 s"],
  [3_000, 3_900, "3.0–3.9 s"],
  [93_000, 93_600, "1:33"],
  [59_000, 61_000, "59.0 s–1:01"],
])("%s ms, %s at most: %s", (took, atMost, words) => {
  expect(tookWords({ took, atMost })).toBe(words);
});
