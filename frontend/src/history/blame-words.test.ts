import { expect, test } from "vitest";
import type { FieldBlame } from "../api/history";
import { plainFieldWords } from "../graph/field-words";
import { blamedValue, toldFields } from "./value-spans";

const blame = (field: string): FieldBlame => ({
  ...{ field, value: "a", before: null, seq: 2, at: "2026-01-01T00:00:00Z" },
  author: { id: "ada", name: "Ada" },
});

test("fields are called as in the form", () => {
  expect(["", "in/speed", "out/side", "on_true", "position"].map(plainFieldWords)).toEqual([
    "name",
    "speed",
    "output side",
    "when true",
    "place",
  ]);
});

test("values are said without what they are wrapped in", () => {
  expect(blamedValue("in/speed", '{"pvf_type":"number","pvf_value":0.9}')).toBe("0.9");
  expect(blamedValue("position", [1.4, 2.6])).toBe("1, 3");
  expect(blamedValue("required", false)).toBe("no");
  expect(blamedValue("actor", "")).toBe("nothing");
});

test("the name comes first, places last, and the order of things not at all", () => {
  const told = toldFields(["position", "order", "in/speed", ""].map(blame));
  expect(told.map(({ field }) => field)).toEqual(["", "in/speed", "position"]);
});
