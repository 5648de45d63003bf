import { expect, test } from "vitest";
import { addParameter, connect, setField, setParameter, undoOf } from "../graph/edit";
import { actionIn, docWith, relationIn } from "../testing/edited-graph";
import { canSetBack, setBack } from "./value-history";

const number = (value: number, more = "") => `{"pvf_type":"number"${more},"pvf_value":${value}}`;

test("a value is set back as one step, and leaves what else was changed about it", () => {
  const [doc, key = ""] = docWith("Drive");
  addParameter(doc, key, "in", "speed", number(0.4));
  setParameter(doc, key, "in", "speed", () => number(0.9, ',"pvf_updatable":false'));
  const undo = undoOf(doc);
  expect(setBack(doc, key, "in/speed", number(0.4))).toBe(true);
  const [speed] = actionIn(doc, key)?.inputs ?? [];
  expect(JSON.parse(speed?.text ?? "")).toEqual(JSON.parse(number(0.4, ',"pvf_updatable":false')));
  undo.undo();
  expect(actionIn(doc, key)?.inputs[0]?.text).toContain("0.9");
});

test("a parameter of another type is made what it was; one that is gone comes back", () => {
  const [doc, key = ""] = docWith("Drive");
  addParameter(doc, key, "in", "to", '{"pvf_type":"string","pvf_value":"office"}');
  expect(setBack(doc, key, "in/to", number(5))).toBe(true);
  expect(actionIn(doc, key)?.inputs[0]?.text).toBe(number(5));
  expect(setBack(doc, key, "in/speed", number(1))).toBe(true);
  expect(actionIn(doc, key)?.inputs.map(({ path }) => path)).toEqual(["to", "speed"]);
});

test("texts and what follows an outcome are set back, too", () => {
  const [doc, a = "", b = ""] = docWith("A", "B");
  setField(doc, a, "actor", "atlas");
  expect(setBack(doc, a, "actor", "spot")).toBe(true);
  expect(actionIn(doc, a)?.actor).toBe("spot");
  connect(doc, a, b);
  expect(setBack(doc, `${a}>${b}`, "on_error", "stop")).toBe(true);
  expect(relationIn(doc, `${a}>${b}`)?.conditions.on_error).toBe("stop");
});

test("what is gone, and what is nobody's to set, stays", () => {
  const [doc] = docWith("A");
  expect(setBack(doc, "abcdefghijkl", "in/speed", number(1))).toBe(false);
  expect([canSetBack("position", [1, 2]), canSetBack("in/x", null)]).toEqual([false, false]);
});
