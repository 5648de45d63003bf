import { expect, test } from "vitest";
import { copyName } from "./graph-menu";

test("a copy gets the first name that no graph has", () => {
  expect(copyName("patrol", ["patrol"])).toBe("patrol copy");
  expect(copyName("patrol", ["patrol", "patrol copy", "patrol copy 2"])).toBe("patrol copy 3");
  expect(copyName("", [])).toBe("untitled copy");
});
