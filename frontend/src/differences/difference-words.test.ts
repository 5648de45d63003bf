import { expect, test } from "vitest";
import { fieldWords } from "../graph/field-words";
import { changedLines, linesOf } from "./difference-words";

test("of a parameter only what is another is told", () => {
  const before = '{"pvf_type":"number","pvf_value":1}';
  const after = '{"pvf_type":"number","pvf_value":2,"pvf_required":false}';
  expect(changedLines({ field: "in/pose/x", before, after })).toEqual([
    { name: "input pose.x", before: "1", after: "2" },
    { name: "input pose.x, required", before: null, after: "false" },
  ]);
});

test("a parameter that came is told as a whole", () => {
  const after = '{"pvf_type":"string","pvf_allowed_values":["a"],"pvf_required":false}';
  expect(changedLines({ field: "out/side", before: null, after })).toEqual([
    { name: "output side", before: null, after: 'string, optional, one of ["a"]' },
  ]);
});

test("other fields are values", () => {
  expect(changedLines({ field: "description", before: "a", after: "b" })).toEqual([
    { name: "description", before: "a", after: "b" },
  ]);
  expect(fieldWords("remap/a")).toBe("remap of a");
});

test("the numbers of a pose that came are one line", () => {
  const after = '{"pvf_type":"number"}';
  const came = ["grip/position/x", "grip/position/y", "speed"].map((path) => ({
    field: `in/${path}`,
    before: null,
    after,
  }));
  const changed = { field: "in/grip/w", before: after, after: '{"pvf_type":"string"}' };
  expect(linesOf([...came, changed])).toEqual([
    { name: "input grip.(position.x, position.y)", before: null, after: "number" },
    { name: "input speed", before: null, after: "number" },
    { name: "input grip.w, type", before: '"number"', after: '"string"' },
  ]);
});

test("what the JSON says besides is told by its name", () => {
  const before = '{"pvf_type":"number","pvf_value":1}';
  const after = '{"pvf_type":"number","pvf_unit":"m","pvf_value":1}';
  expect(changedLines({ field: "in/x", before, after })).toEqual([
    { name: "input x, unit", before: null, after: '"m"' },
  ]);
});
