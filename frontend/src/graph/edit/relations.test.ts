import { expect, test } from "vitest";
import type * as Y from "yjs";
import {
  actionIn,
  arrows,
  copyOf,
  docWith,
  exchange,
  graphIn,
  relationIn,
  says,
  updatesOf,
} from "../../testing/edited-graph";
import { relationId } from "../document-keys";
import { ENTRY, EXIT, type Key, type Relation } from "../model";
import {
  addAction,
  addParameter,
  adoptGhost,
  connect,
  disconnect,
  insertInto,
  mirrorRelation,
  moveRelation,
  removeActions,
  removeParameter,
  removeRelation,
  rename,
  setEntry,
  setExit,
  setField,
  setNote,
  setParameter,
  setRemap,
  setRequired,
  setResponse,
  unsetEntry,
  unsetExit,
} from ".";

// -- relations --------------------------------------------------------------------------------

test("a new arrow says what was drawn and nothing else", () => {
  const [doc, a, b, c] = docWith("A", "B", "C") as [Y.Doc, Key, Key, Key];
  const onFalse = connect(doc, a, b, "on_false");
  const onTrue = connect(doc, a, c, "on_true");
  expect(says(relationIn(doc, onFalse))).toEqual(["on_false -> run"]);
  expect(says(relationIn(doc, onTrue))).toEqual(["on_true -> run"]);
  expect(relationIn(doc, onTrue)).toMatchObject({ parentOrder: 1, childOrder: 0, required: true });
});

test("connecting two that are connected adds the outcome", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const id = connect(doc, a, b, "on_true");
  expect(connect(doc, a, b, "on_error")).toBe(id);
  expect(says(relationIn(doc, id))).toEqual(["on_true -> run", "on_error -> run"]);
});

test("drawing clears leftovers of a relation that was there before", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const id = connect(doc, a, b) as string;
  const colleague = copyOf(doc);
  removeRelation(doc, id);
  setRequired(colleague, id, false);
  setRemap(colleague, id, "x", "y");
  exchange(doc, colleague);
  expect(relationIn(doc, id)).toBeUndefined();
  connect(doc, a, b, "on_false");
  expect(relationIn(doc, id)).toMatchObject({ required: true, remap: [] });
});

test("two people who connect the same pair both take effect", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const colleague = copyOf(doc);
  const id = connect(doc, a, b, "on_true");
  connect(colleague, a, b, "on_error");
  exchange(doc, colleague);
  expect(says(relationIn(doc, id))).toEqual(["on_true -> run", "on_error -> run"]);
  expect(graphIn(doc)).toEqual(graphIn(colleague));
});

test("no arrow leads into the entry, out of the exit, from one to the other, or to a missing action", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  for (const [parent, child] of [
    [a, ENTRY],
    [EXIT, a],
    [ENTRY, EXIT],
    [a, "nobodynobody"],
    ["nobodynobody", a],
    ["x", a],
  ] as const)
    expect(connect(doc, parent, child)).toBeNull();
  expect(graphIn(doc).relations).toEqual([]);
});

test("an entry says run and nothing else; an exit says after which outcomes", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const entry = setEntry(doc, a) as string;
  expect(setResponse(doc, entry, "on_false", "run")).toBe(false);
  const exit = setExit(doc, a, "on_false");
  setExit(doc, a, "on_true");
  expect(says(relationIn(doc, entry))).toEqual(["on_true -> run"]);
  expect(says(relationIn(doc, exit))).toEqual(["on_true -> run", "on_false -> run"]);
  expect(unsetEntry(doc, a) && unsetExit(doc, a)).toBe(true);
  expect(unsetExit(doc, a)).toBe(false);
  expect(graphIn(doc).relations).toEqual([]);
});

test("a relation that only ignores is still a relation", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const id = connect(doc, a, b) as string;
  setResponse(doc, id, "on_true", "ignore");
  expect(says(relationIn(doc, id))).toEqual([]);
});

test("a one-sided relation stays so until an edit needs the other side, or it is mirrored", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const id = connect(doc, a, b) as string;
  const set = (side: string) => doc.getMap("relations").set(`${id}|only`, side);
  set("children");
  setRemap(doc, id, "x", "y");
  expect(relationIn(doc, id)?.only).toBe("children");
  setResponse(doc, id, "on_error", "stop");
  expect(relationIn(doc, id)?.only).toBeNull();
  set("parents");
  setRemap(doc, id, "x", null);
  expect(relationIn(doc, id)).toMatchObject({ only: null, remap: [] });
  set("parents");
  mirrorRelation(doc, id);
  expect(relationIn(doc, id)?.only).toBeNull();
});

test("an arrow led elsewhere keeps what it says", () => {
  const [doc, a, b, c] = docWith("A", "B", "C") as [Y.Doc, Key, Key, Key];
  const id = connect(doc, a, b, "on_error", "stop") as string;
  setRequired(doc, id, false);
  setRemap(doc, id, "x", "y");
  const moved = moveRelation(doc, id, { child: c });
  expect(relationIn(doc, id)).toBeUndefined();
  expect(relationIn(doc, moved)).toMatchObject({
    required: false,
    remap: [{ source: "x", target: "y" }],
  });
  expect(says(relationIn(doc, moved))).toEqual(["on_error -> stop"]);
  connect(doc, a, b);
  expect(moveRelation(doc, moved as string, { child: b })).toBeNull();
  expect(arrows(doc)).toEqual(["A>B", "A>C"]);
});

test("an action put into an arrow takes over what it said, and its success leads on", () => {
  const [doc, a, b, c, x] = docWith("A", "B", "C", "X") as [Y.Doc, Key, Key, Key, Key];
  const id = connect(doc, a, b, "on_false") as string;
  connect(doc, a, c);
  expect(insertInto(doc, id, x)).toBe(true);
  expect(arrows(doc)).toEqual(["A>C", "A>X", "X>B"]);
  expect(says(relationIn(doc, `${a}>${x}`))).toEqual(["on_false -> run"]);
  expect(relationIn(doc, `${a}>${x}`)?.parentOrder).toBe(0);
  expect(says(relationIn(doc, `${x}>${b}`))).toEqual(["on_true -> run"]);
});

test("disconnecting removes every listing of a pair", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  connect(doc, a, b);
  doc.getMap("relations").set(`${a}>${b};2|on_true`, "run");
  expect(disconnect(doc, a, b)).toBe(true);
  expect(graphIn(doc).relations).toEqual([]);
});

test("edits of what a colleague deleted do nothing and say so", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const id = connect(doc, a, b) as string;
  addParameter(doc, a, "in", "x", "1");
  removeActions(doc, [a]);
  const edits = () => [
    rename(doc, a, "N"),
    setField(doc, a, "type", "t"),
    setParameter(doc, a, "in", "x", () => "2"),
    addParameter(doc, a, "in", "y", "2"),
    removeParameter(doc, a, "in", "x"),
    setResponse(doc, id, "on_true", "stop"),
    setRequired(doc, id, false),
    setRemap(doc, id, "x", "y"),
    removeRelation(doc, id),
    insertInto(doc, id, b),
    adoptGhost(doc, a),
    setNote(doc, "n", "{}"),
  ];
  expect(updatesOf(doc, () => expect(new Set(edits())).toEqual(new Set([false])))).toBe(0);
});

// -- ghosts -----------------------------------------------------------------------------------

function withGhost(): [Y.Doc, Key, Key] {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const ghost = "GhostGhost00";
  doc.getMap("actions").set(ghost, "Cook");
  doc.getMap("actions").set(`${ghost}|missing`, true);
  connect(doc, a, ghost, "on_error");
  return [doc, a, ghost];
}

test("a ghost's arrows become those of the action that takes up its name, and stay with it", () => {
  const [doc, , ghost] = withGhost();
  const cook = addAction(doc, { name: "Cook" });
  rename(doc, cook, "Bake");
  expect(arrows(doc)).toEqual(["A>Bake"]);
  expect(actionIn(doc, ghost)).toBeUndefined();
  expect(actionIn(doc, cook)?.instanceId).toBe(0);
});

test("an arrow of a ghost that a colleague filled meanwhile can be edited as it is shown", () => {
  const [doc, a, ghost] = withGhost();
  doc.getMap("actions").set("CookCookCook", "Cook");
  const [shown] = graphIn(doc).relations;
  expect(shown).toMatchObject({ parent: a, child: "CookCookCook" });
  expect(setResponse(doc, relationId(shown as Relation), "on_error", "stop")).toBe(true);
  expect(says(graphIn(doc).relations[0])).toEqual(["on_error -> stop"]);
  expect([...doc.getMap("actions").keys()].some((key) => key.startsWith(ghost))).toBe(false);
});

test("a ghost can be made an action", () => {
  const [doc, , ghost] = withGhost();
  adoptGhost(doc, ghost, { type: "async", inputs: [{ path: "x", text: "1" }] });
  expect(actionIn(doc, ghost)).toMatchObject({ missing: false, type: "async" });
  expect(arrows(doc)).toEqual(["A>Cook"]);
});
