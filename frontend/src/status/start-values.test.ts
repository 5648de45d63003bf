import { expect, test } from "vitest";
import type { AskedInput } from "../api/starts";
import { draftOf, firstDrafts, givenBy, placeRefused, typedValues } from "./start-values";
import { placeOfInput, valueLines, valuesWords } from "./value-words";

const input = (more: Partial<AskedInput> = {}): AskedInput => ({
  action: "Go_0",
  name: "place",
  aid: "A",
  type: "string",
  open: true,
  ...more,
});
const torque = input({ name: "torque", type: "number", open: false, value: 5, least: 0, most: 60 });

test.each<[Partial<AskedInput>, string, unknown]>([
  [{}, "valve_8", "valve_8"],
  [{}, " ", " "],
  [{ type: "number" }, "1,5", "wrong"],
  [{ type: "number" }, ".5", 0.5],
  [{ type: "number" }, "1e999", "wrong"],
  [{ type: "number" }, "NaN", "wrong"],
  [{ type: "number", least: 0 }, "-0.1", "wrong"],
  [{ type: "number", most: 60 }, "60", 60],
  [{ type: "number", most: 60 }, "60.1", "wrong"],
  [{ type: "numbers", most: 60 }, "1\n61", "wrong"],
  [{ type: "numbers" }, "1\n2", [1, 2]],
  [{ type: "strings" }, "a\nb", ["a", "b"]],
  [{ type: "bool" }, "true", true],
  [{ type: "bool" }, "yes", "wrong"],
  [{ allowed: ["fast"] }, "slow", "wrong"],
  [{ allowed: ["fast"] }, "fast", "fast"],
  [{ type: "geometry/Frame" }, "x", "wrong"],
  [{}, "", "wrong"],
  [{ open: false, value: "here" }, "", "wrong"],
  [{ open: false }, "", "none"],
])("%j with “%s” typed is %j", (more, draft, expected) => {
  const given = givenBy(input(more), draft);
  expect(given.kind === "value" ? given.value : given.kind).toEqual(expected);
});

test("a value that the graph has is not sent, so that nothing of its version is changed", () => {
  const asked = [input(), torque];
  const drafts = { ...firstDrafts(asked), [placeOfInput(asked[0] ?? torque)]: "valve_8" };
  expect(typedValues(asked, drafts)).toEqual({
    values: { Go_0: { place: "valve_8" } },
    wrong: new Map(),
  });
});

test("a form begins with what was given before, and says what is missing", () => {
  const asked = [input(), torque];
  const [place] = asked;
  const drafts = firstDrafts(asked, undefined, { Go_0: { torque: 7 }, Gone_0: { x: 1 } });
  expect(Object.values(drafts)).toEqual(["", "7"]);
  const { values, wrong } = typedValues(asked, drafts);
  expect(values).toEqual({ Go_0: { torque: 7 } });
  expect([...wrong.keys()]).toEqual([place && placeOfInput(place)]);
});

test.each<[string, AskedInput["value"]]>([
  ["string", "a\nb"],
  ["number", 1e21],
  ["bool", false],
  ["strings", ["a", "b"]],
  ["numbers", [1, -2.5]],
])("a %s that is shown means the same again", (type, value) => {
  const asked = input({ type });
  expect(givenBy(asked, draftOf(asked, value))).toEqual({ kind: "value", value });
});

test("a hostile text stands by itself among the values", () => {
  const values = { Go_0: { "pose::x": 1, place: "\u202Etxet" }, ["__proto__"]: { place: "x" } };
  expect(valueLines(values).map(({ input: name }) => name)).toEqual(["pose.x", "place", "place"]);
  expect(valuesWords(values)).toContain('\u2068Go place = "\u202Etxet"\u2069');
});

test("an action with the name of a member of all objects gets its value", () => {
  const asked = [input({ action: "__proto__", name: "constructor" })];
  expect(Object.values(firstDrafts(asked, {}))).toEqual([""]);
  const { values } = typedValues(asked, { [placeOfInput(asked[0] ?? torque)]: "x" });
  expect(JSON.stringify(values)).toBe('{"__proto__":{"constructor":"x"}}');
});

test("a refusal shows at its field", () => {
  expect(placeRefused("/values/Go_0/pose::a~1b")).toBe(
    placeOfInput({ action: "Go_0", name: "pose::a/b" }),
  );
  for (const path of ["", "/values", "/values/Go_0", "/engine/x/y"])
    expect(placeRefused(path)).toBeNull();
});
