import fc from "fast-check";
import { expect, test } from "vitest";
import { memberText, withMember } from "./json-members";

test("a number keeps its spelling", () => {
  expect(memberText('{"a": 1, "umrf": {"x": 5.0, "y": [1e2, "}"]}, "z": 2}', "umrf")).toBe(
    '{"x": 5.0, "y": [1e2, "}"]}',
  );
});

test("a member of a nested object is not the object's own", () => {
  expect(memberText('{"a": {"umrf": 1}}', "umrf")).toBeNull();
  expect(memberText("{}", "umrf")).toBeNull();
});

test("every member of every object is found whole", () => {
  fc.assert(
    fc.property(fc.dictionary(fc.string(), fc.jsonValue()), fc.nat(2), (object, indent) => {
      const text = JSON.stringify(object, null, indent);
      for (const [name, value] of Object.entries(JSON.parse(text) as object)) {
        expect(JSON.parse(memberText(text, name) ?? "missing")).toEqual(value);
      }
    }),
  );
});

test("setting one member leaves the others as they are spelled", () => {
  const text = '{"pvf_type": "number", "pvf_value": 5.0, "x": [1,  2]}';
  expect(withMember(text, "pvf_value", "6")).toBe(
    '{"pvf_type": "number", "pvf_value": 6, "x": [1,  2]}',
  );
  expect(withMember(text, "pvf_value", null)).toBe('{"pvf_type": "number", "x": [1,  2]}');
  expect(withMember('{"a": 1}', "b", "2")).toBe('{"a": 1, "b": 2}');
});
