import { expect, test } from "vitest";
import { targetsOf } from "./arrow-dialog";

const here = [{ id: "a1", label: "DriveTo 0" }];
const known = [{ name: "DriveTo" }, { name: "GripTool" }, { name: "Tell" }];
const labels = (search: string) => targetsOf(here, known, search).map(({ label }) => label);

test("targets are found on the canvas first, then in the library, and are new last", () => {
  expect(labels("")).toEqual(["DriveTo 0"]);
  expect(labels("grip")).toEqual(["GripTool", "New action “grip”"]);
  expect(labels("griptool")).toEqual(["GripTool"]);
  expect(labels("DriveTo")).toEqual(["DriveTo 0", "DriveTo"]);
  expect(labels("Sing")).toEqual(["New action “Sing”"]);
});
