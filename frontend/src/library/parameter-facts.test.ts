import { expect, test } from "vitest";
import { fresh } from "../graph/parameters/values";
import { parameterFacts } from "./parameter-facts";

const pose = ["x", "y", "z"]
  .map((axis) => `pose/position/${axis}`)
  .concat(["x", "y", "z", "w"].map((axis) => `pose/orientation/${axis}`))
  .map((path) => ({ path, text: fresh("number") }));

test("a pose is one row", () => {
  expect(parameterFacts(pose)).toEqual([
    {
      path: "pose/",
      name: "pose",
      type: "pose",
      required: true,
      allowed: "x y z · x y z w",
      value: null,
      more: [],
    },
  ]);
});

test("other members of the JSON are listed", () => {
  const text =
    '{"pvf_type":"number","pvf_unit":"N·m","pvf_example":12.50,"pvf_required":false,"pvf_allowed_values":[1, 2.0],"pvf_value":1.0,"pvf_updatable":false}';
  expect(parameterFacts([{ path: "torque", text }])).toEqual([
    {
      path: "torque",
      name: "torque",
      type: "number",
      required: false,
      allowed: "1, 2.0",
      value: "1.0",
      more: ["unit N·m", "example 12.50", "locked"],
    },
  ]);
});

test("a parameter without a type has no value and no other members", () => {
  expect(parameterFacts([{ path: "odd", text: "[1]" }])[0]).toMatchObject({
    type: "no type",
    value: null,
    more: [],
  });
});
