import { expect, test } from "vitest";
import { bytes, span } from "./status";

test.each([
  [0, "0 bytes"],
  [999, "999 bytes"],
  [1_000, "1.0 kB"],
  [9_949, "9.9 kB"],
  [9_951, "10 kB"],
  [999_499, "999 kB"],
  [999_500, "1.0 MB"],
  [76_504_817_664, "77 GB"],
  [4e15, "4000 TB"],
])("%d bytes are %s", (count, said) => expect(bytes(count)).toBe(said));

test.each([
  [-5, "0 s"],
  [59_999, "59 s"],
  [60_000, "1 min 0 s"],
  [7_500_000, "2 h 5 min"],
  [86_400_000, "1 day 0 h"],
  [270_000_000, "3 days 3 h"],
])("%d ms are %s", (ms, said) => expect(span(ms)).toBe(said));
