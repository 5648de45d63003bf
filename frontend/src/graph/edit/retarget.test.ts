import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf, relationId } from "../document-keys";
import { ENTRY, EXIT } from "../model";
import { readGraph } from "../read";
import { addAction, connect, retarget, setEntry, setRemap, setRequired, undoOf } from ".";

function drawn() {
  const doc = new Y.Doc();
  const [a, b, c] = ["A", "B", "C"].map((name) => addAction(doc, { name })) as [
    string,
    string,
    string,
  ];
  const arrow = connect(doc, a, b, "on_true", "stop") ?? "";
  const said = () =>
    readGraph(mapsOf(doc)).relations.map(({ parent, child, conditions }) => ({
      id: relationId({ parent, child }),
      ...Object.fromEntries(Object.entries(conditions).filter(([, then]) => then !== "ignore")),
    }));
  return { doc, a, b, c, arrow, said };
}

test("an arrow that says one thing goes with all it says", () => {
  const { doc, a, c, arrow, said } = drawn();
  setRequired(doc, arrow, false);
  setRemap(doc, arrow, "out", "in");
  const undo = undoOf(doc);
  expect(retarget(doc, arrow, "on_true", { child: c })).toBe(`${a}>${c}`);
  expect(said()).toEqual([{ id: `${a}>${c}`, on_true: "stop" }]);
  const [moved] = readGraph(mapsOf(doc)).relations;
  expect(moved).toMatchObject({ required: false, remap: [{ source: "out", target: "in" }] });
  undo.undo();
  expect(said()).toEqual([{ id: arrow, on_true: "stop" }]);
});

test("only the redirected outcome of a relation with several moves", () => {
  const { doc, a, b, c, arrow, said } = drawn();
  connect(doc, a, b, "on_false");
  expect(retarget(doc, arrow, "on_true", { child: c })).toBe(`${a}>${c}`);
  expect(said()).toContainEqual({ id: arrow, on_false: "run" });
  expect(said()).toContainEqual({ id: `${a}>${c}`, on_true: "stop" });
});

test("the beginning of an arrow can be led to another outcome, of the same action or another", () => {
  const { doc, b, c, arrow, said } = drawn();
  retarget(doc, arrow, "on_true", { outcome: "on_error" });
  expect(said()).toEqual([{ id: arrow, on_error: "stop" }]);
  retarget(doc, arrow, "on_error", { parent: c, outcome: "on_stopped" });
  expect(said()).toEqual([{ id: `${c}>${b}`, on_stopped: "stop" }]);
});

test("between the entry and actions an arrow says what such an arrow can say", () => {
  const { doc, a, b, c, said } = drawn();
  const first = setEntry(doc, a) ?? "";
  expect(retarget(doc, first, "on_true", { child: c })).toBe(`${ENTRY}>${c}`);
  expect(retarget(doc, `${ENTRY}>${c}`, "on_true", { child: EXIT })).toBeNull();
  expect(retarget(doc, `${a}>${b}`, "on_true", { parent: ENTRY })).toBe(`${ENTRY}>${b}`);
  expect(said().map(({ id }) => id)).toEqual([`${ENTRY}>${b}`, `${ENTRY}>${c}`].sort());
});

test("an arrow that a colleague deleted cannot be redirected", () => {
  const { doc, c, arrow } = drawn();
  expect(retarget(doc, `${c}>${EXIT}`, "on_true", { parent: c })).toBeNull();
  expect(retarget(doc, arrow, "on_true", { child: "AAAAAAAAAAAA" })).toBeNull();
});
