import { expect, test } from "vitest";
import * as Y from "yjs";
import { actionIn, copyOf, exchange, graphIn } from "../../testing/edited-graph";
import { askKey, rootOf } from "../document-keys";
import {
  addAction,
  connect,
  removeParameter,
  renameParameter,
  setEntry,
  setParameter,
  undoOf,
} from "../edit";
import { setAsk } from "../edit/asks";
import { askedPaths, askOf } from "./asked-inputs";
import { withValue } from "./values";

const leaf = (type: string, more = {}) => JSON.stringify({ pvf_type: type, ...more });

/** Go, the entry, leads to Look and brings it `found`. */
function goAndLook() {
  const doc = new Y.Doc();
  const go = addAction(doc, {
    name: "Go",
    inputs: [
      { path: "place", text: leaf("string") },
      { path: "speed", text: leaf("number", { pvf_value: 2 }) },
      { path: "frame", text: leaf("geometry/Frame") },
      { path: "note", text: leaf("string", { pvf_required: false }) },
    ],
    outputs: [{ path: "found", text: leaf("string") }],
  });
  const look = addAction(doc, {
    name: "Look",
    inputs: [
      { path: "found", text: leaf("string") },
      { path: "at/x", text: leaf("number") },
    ],
  });
  setEntry(doc, go);
  connect(doc, go, look);
  const asked = () =>
    [...askedPaths(graphIn(doc))].flatMap(([key, paths]) =>
      [...paths].map((path) => `${actionIn(doc, key)?.name} ${path}`),
    );
  return { doc, go, look, asked };
}

test("a start asks for what the graph leaves open, and for nothing that an arrow brings", () => {
  const { doc, go, asked } = goAndLook();
  expect(asked()).toEqual(["Go place", "Look at/x"]);
  setParameter(doc, go, "in", "place", (now) => withValue(now, '"here"'));
  expect(asked()).toEqual(["Look at/x"]);
});

test("an action to which no arrow leads is asked for nothing", () => {
  const doc = new Y.Doc();
  addAction(doc, { name: "Go", inputs: [{ path: "place", text: leaf("string") }] });
  expect(askedPaths(graphIn(doc)).size).toBe(0);
});

test("a start asks for what the author marks, unless an arrow brings it each time", () => {
  const { doc, go, look, asked } = goAndLook();
  expect(setAsk(doc, go, "speed", { most: 60 })).toBe(true);
  expect(setAsk(doc, go, "note", {})).toBe(true);
  expect(setAsk(doc, go, "frame", {})).toBe(true);
  expect(setAsk(doc, look, "found", {})).toBe(true);
  expect(setAsk(doc, go, "gone", {})).toBe(false);
  expect(asked()).toEqual(["Go place", "Go speed", "Go note", "Look at/x"]);
});

test("a mark is an edit of its own, which undo takes back and colleagues get", () => {
  const { doc, go } = goAndLook();
  const theirs = copyOf(doc);
  const undo = undoOf(doc);
  setAsk(doc, go, "speed", { least: 0, most: 60 });
  setParameter(theirs, go, "in", "speed", (now) => withValue(now, "7"));
  exchange(doc, theirs);
  const seen = actionIn(theirs, go);
  expect(seen && askOf(seen, "speed")).toEqual({ least: 0, most: 60 });
  expect(actionIn(doc, go)?.inputs[1]?.text).toContain("7");
  undo.undo();
  expect(actionIn(doc, go)?.asks).toBeUndefined();
  expect(actionIn(doc, go)?.inputs[1]?.text).toContain("7");
});

test("a mark goes with its input: renamed, and removed", () => {
  const { doc, go } = goAndLook();
  setAsk(doc, go, "speed", { most: 60 });
  renameParameter(doc, go, "in", "speed", "pace");
  const renamed = actionIn(doc, go);
  expect(renamed && askOf(renamed, "pace")).toEqual({ most: 60 });
  expect(renamed && askOf(renamed, "speed")).toBeNull();
  removeParameter(doc, go, "in", "pace");
  expect(rootOf(doc, "actions").has(askKey(go, "pace"))).toBe(false);
});

test.each(["[]", "7", '"x"', '{"most":"60"}', "{"])(
  "a mark of another form, %s, has no bounds",
  (text) => {
    const { doc, go } = goAndLook();
    rootOf(doc, "actions").set(askKey(go, "speed"), text);
    const action = actionIn(doc, go);
    const known = action && askOf(action, "speed");
    expect(known).toEqual(text === "{" ? null : {});
  },
);
