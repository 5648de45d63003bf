import { expect, test } from "vitest";
import { copyNameOf } from "./copy-name";

test("a copy is called after the version, and like nothing that is there", () => {
  expect(copyNameOf("valves", "v3", ["valves"])).toBe("valves v3");
  expect(copyNameOf("valves", "v3", ["valves v3", "valves v3 2"])).toBe("valves v3 3");
  expect(copyNameOf("", "v3", [])).toBe("untitled v3");
});
