import fc from "fast-check";
import { expect, test } from "vitest";
import {
  allowedLines,
  complaint,
  parameterValueOf,
  shown,
  typed,
  withAllowed,
  withLock,
  withRequired,
  withType,
  withValue,
} from "./values";

test("a number keeps the spelling in which it was typed", () => {
  const text = withValue('{"pvf_type": "number"}', "5.0");
  expect(text).toBe('{"pvf_type": "number", "pvf_value": 5.0}');
  expect(shown(parameterValueOf(text))).toBe("5.0");
});

test("a text that is no number is explained and not written", () => {
  const field = parameterValueOf('{"pvf_type": "number", "pvf_value": 30}');
  expect(complaint(field, "abc")).toBe("“abc” is no number.");
  expect(complaint(field, "-.5")).toBeNull();
  expect(typed("number", "-.5")).toEqual({ ok: "-0.5" });
});

test("only allowed values are taken", () => {
  const field = parameterValueOf('{"pvf_type": "string", "pvf_allowed_values": ["red", "blue"]}');
  expect(complaint(field, "green")).toContain("Allowed");
  expect(complaint(field, "red")).toBeNull();
});

test("lists have a line for each item", () => {
  expect(typed("numbers", "1\n 2.5\n")).toEqual({ ok: "[1, 2.5]" });
  expect(shown(parameterValueOf('{"pvf_type":"strings","pvf_value":["a b","c"]}'))).toBe("a b\nc");
  expect(typed("bools", "true\nmaybe")).toEqual({ wrong: "“maybe” is neither true nor false." });
});

test("an empty number has no value, an empty string has one", () => {
  expect(typed("number", " ")).toEqual({ ok: null });
  expect(typed("string", "")).toEqual({ ok: '""' });
});

test("a parameter of a foreign type is left alone", () => {
  const field = parameterValueOf('{"pvf_type": "map::Pose"}');
  expect([field.type, field.native, field.value]).toEqual(["map::Pose", null, null]);
});

test("any text that is typed comes back as it was", () => {
  fc.assert(
    fc.property(fc.string(), (draft) => {
      const result = typed("string", draft);
      if (!("ok" in result) || result.ok === null) throw new Error("a string is always fine");
      expect(shown(parameterValueOf(withValue('{"pvf_type": "string"}', result.ok)))).toBe(draft);
    }),
  );
});

test("another type keeps a value that fits it and takes away one that does not", () => {
  const text = '{"pvf_type": "number", "pvf_value": 5.0, "unit": "m"}';
  expect(withType(text, "string")).toBe('{"pvf_type": "string", "unit": "m"}');
  expect(withType('{"pvf_type": "geo::Pose", "pvf_value": 5.0}', "number")).toBe(
    '{"pvf_type": "number", "pvf_value": 5.0}',
  );
});

test("allowed values are of the type, one a line, and none allows all", () => {
  const text = '{"pvf_type": "number"}';
  const some = withAllowed(text, "1\n 2.50\n");
  expect(some).toEqual({ ok: '{"pvf_type": "number", "pvf_allowed_values": [1, 2.50]}' });
  expect(withAllowed(text, "red")).toEqual({ wrong: "“red” is no number." });
  if (!("ok" in some)) throw new Error("they fit");
  expect(allowedLines(parameterValueOf(some.ok ?? ""))).toBe("1\n2.50");
  expect(withAllowed(some.ok ?? "", "")).toEqual({ ok: text });
});

test("defaults of the engine are not written", () => {
  const text = '{"pvf_type": "bool"}';
  expect(parameterValueOf(withRequired(text, false)).required).toBe(false);
  expect(withRequired(withRequired(text, false), true)).toBe(text);
  expect(parameterValueOf(withLock(text, true)).locked).toBe(true);
  expect(withLock(withLock(text, true), false)).toBe(text);
});
