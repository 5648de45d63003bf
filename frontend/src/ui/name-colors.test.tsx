import { expect, test } from "vitest";
import { initials } from "./name-colors";

test.each([
  ["Ada", "AD"],
  ["Ada Lovelace", "AL"],
  ["Ada of the House Lovelace", "AL"],
  ["名前 さん", "名さ"],
  ["اسم", "اس"],
  ["🤖🏳️‍🌈", "🤖🏳️‍🌈"],
  ["👩‍🚀 Kai", "👩‍🚀K"],
  ["é", "É"],
  ["  ", "?"],
  ["", "?"],
])("the initials of %s are whole letters", (name, letters) => {
  expect(initials(name)).toBe(letters);
});

test("a name that piles up marks does not pile up here", () => {
  expect(initials(`Z${"\u0300".repeat(5000)}`).length).toBeLessThan(30);
});
