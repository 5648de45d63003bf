import { expect, test } from "vitest";
import { freshName } from "./new-graphs";

test("a new graph has a name that no other one has", () => {
  expect(freshName([])).toBe("task_1");
  expect(freshName(["task_1", "task_3", "fetch_tool"])).toBe("task_2");
});
