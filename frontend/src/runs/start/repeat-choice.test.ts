import { expect, test } from "vitest";
import type { AskedInput } from "../../api/starts";
import { linesGiven, withoutGrid } from "./repeat-choice";

const torque: AskedInput = {
  action: "Turn_0",
  name: "torque",
  aid: "a",
  type: "number",
  open: true,
  most: 60,
};

test("each line is a value, and the first that is none is named", () => {
  expect(linesGiven(torque, "1\n\n 2.5 \n")).toEqual({ values: [1, 2.5], wrong: "" });
  expect(linesGiven(torque, "1\n61").wrong).toContain("60 at most.");
  expect(linesGiven(torque, "1\nmuch").wrong).toContain("much");
});

test("an input of the grid has no value besides", () => {
  const values = { Turn_0: { torque: 3, place: "a" }, Lift_0: { height: 1 } };
  const grid = [
    { action: "Turn_0", name: "torque", values: [1] },
    { action: "Lift_0", name: "height", values: [2] },
  ];
  expect(withoutGrid(values, grid)).toEqual({ Turn_0: { place: "a" } });
});
