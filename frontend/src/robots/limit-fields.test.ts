import { expect, test } from "vitest";
import { limitWords } from "../api/rights";
import { draftsOf, limitsOf } from "./limit-fields";

test("lines without a parameter are no limits, and names have no blanks around them", () => {
  const torque = { parameter: " torque ", action: "", least: null, most: 60 };
  const empty = { parameter: " ", action: "Grip", least: 1, most: null };
  expect(limitsOf(draftsOf([torque, empty]))).toEqual([
    { parameter: "torque", action: "", least: null, most: 60 },
  ]);
});

test("a limit is said with its action and its bounds", () => {
  const limit = { parameter: "torque", action: "Grip", least: 5, most: 60 };
  expect(limitWords(limit)).toBe("torque of Grip from 5 to 60");
  expect(limitWords({ ...limit, action: "", least: null })).toBe("torque at most 60");
  expect(limitWords({ ...limit, action: "", most: null })).toBe("torque at least 5");
});
