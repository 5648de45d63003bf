import fc from "fast-check";
import { expect, test } from "vitest";
import type * as Y from "yjs";
import { arrowsOf, drawnBy, gestures, goesInCircles } from "../../testing/drawn-graphs";
import { actionIn, docWith, graphIn } from "../../testing/edited-graph";
import { ENTRY, EXIT, type Key } from "../model";
import {
  addAction,
  addParameter,
  connect,
  insertInto,
  removeActions,
  retarget,
  setEntry,
  setExit,
  setRequired,
  setResponse,
  undoOf,
} from ".";

/** Returns the names of the actions that the end waits for. */
const waitedFor = (doc: Y.Doc): string[] =>
  graphIn(doc)
    .relations.filter(({ child, required }) => child === EXIT && required)
    .map(({ parent }) => actionIn(doc, parent)?.name ?? "")
    .sort();

const outputs = (doc: Y.Doc, key: Key) => actionIn(doc, key)?.outputs.map(({ text }) => text);

type Three = [Y.Doc, Key, Key, Key];

/** A decides: true leads to B, false to C. */
function decided(): Three {
  const [doc, a, b, c] = docWith("A", "B", "C") as Three;
  setEntry(doc, a);
  connect(doc, a, b, "on_true");
  connect(doc, a, c, "on_false");
  return [doc, a, b, c];
}

test("whichever branch of a decision reaches the end ends the graph, without waiting", () => {
  const [doc, , b, c] = decided();
  setExit(doc, b);
  setExit(doc, c);
  expect(waitedFor(doc)).toEqual([]);
});

test("drawing the ends first and the decision then says the same", () => {
  const [doc, a, b, c] = docWith("A", "B", "C") as Three;
  setExit(doc, b);
  setExit(doc, c);
  expect(waitedFor(doc)).toEqual(["B", "C"]);
  setEntry(doc, a);
  connect(doc, a, b, "on_true");
  connect(doc, a, c, "on_false");
  expect(waitedFor(doc)).toEqual([]);
});

test("the end waits for actions that run side by side, whichever was drawn first", () => {
  const fork = docWith("A", "B", "C") as Three;
  setEntry(fork[0], fork[1]);
  connect(fork[0], fork[1], fork[2]);
  connect(fork[0], fork[1], fork[3]);
  setExit(fork[0], fork[2]);
  setExit(fork[0], fork[3]);
  expect(waitedFor(fork[0])).toEqual(["B", "C"]);

  const [doc, a, b, c] = decided();
  setExit(doc, b);
  setExit(doc, c);
  connect(doc, a, c, "on_true");
  expect(waitedFor(doc)).toEqual(["B", "C"]);
});

test("a second start runs beside the first one", () => {
  const [doc, , b, c] = decided();
  setExit(doc, b);
  setExit(doc, c);
  const d = addAction(doc, { name: "D" });
  setExit(doc, d);
  expect(waitedFor(doc)).toEqual([]); // nothing leads to D yet, so it never reports
  setEntry(doc, d);
  expect(waitedFor(doc)).toEqual(["B", "D"]); // C comes instead of B, and never if all goes well
});

test("a person's own choice about actions that run side by side stays", () => {
  const [doc, a, b, c] = docWith("A", "B", "C") as Three;
  setEntry(doc, a);
  setEntry(doc, b);
  setExit(doc, a);
  const id = setExit(doc, b) as string;
  setRequired(doc, id, false);
  connect(doc, b, c);
  expect(waitedFor(doc)).toEqual(["A"]);
});

test("an action that is put into the way to the end takes the place of the one before it", () => {
  const [doc, , b, c] = decided();
  const id = setExit(doc, b) as string;
  setExit(doc, c);
  const x = addAction(doc, { name: "X" });
  insertInto(doc, id, x);
  expect(waitedFor(doc)).toEqual([]);
  removeActions(doc, [x], { heal: true });
  expect(waitedFor(doc)).toEqual([]);
  expect(graphIn(doc).relations.filter(({ child }) => child === EXIT)).toHaveLength(2);
});

test("an arrow that is led to the end counts like a drawn one", () => {
  const [doc, , b, c] = decided();
  setExit(doc, b);
  const d = addAction(doc, { name: "D" });
  const id = connect(doc, c, d) as string;
  expect(waitedFor(doc)).toEqual(["B"]);
  retarget(doc, id, "on_true", { child: EXIT });
  expect(waitedFor(doc)).toEqual([]);
});

const NUMBER = '{"pvf_type": "number"}';
const FREE = '{"pvf_type": "number", "pvf_required": false}';

test("the end does not wait for outputs that only one of its ways gives", () => {
  const [doc, , b, c] = decided();
  addParameter(doc, c, "out", "x", NUMBER);
  addParameter(doc, c, "out", "given", '{"pvf_type": "number", "pvf_value": 5.0}');
  setExit(doc, b);
  expect(outputs(doc, c)?.[0]).toBe(NUMBER);
  setExit(doc, c);
  expect(outputs(doc, c)).toEqual([FREE, '{"pvf_type": "number", "pvf_value": 5.0}']);
});

test("outputs that every way gives stay as they are", () => {
  const [doc, , b, c] = decided();
  for (const key of [b, c]) addParameter(doc, key, "out", "x", NUMBER);
  setExit(doc, b);
  setExit(doc, c);
  expect([outputs(doc, b), outputs(doc, c)]).toEqual([[NUMBER], [NUMBER]]);
});

test("a failed action has no outputs that the end could wait for", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  addParameter(doc, a, "out", "x", NUMBER);
  const id = setExit(doc, a) as string;
  expect(outputs(doc, a)).toEqual([NUMBER]);
  setResponse(doc, id, "on_error", "run");
  expect(outputs(doc, a)).toEqual([FREE]);
});

test("it is one step of undo with the arrow", () => {
  const [doc, , b, c] = decided();
  addParameter(doc, c, "out", "x", NUMBER);
  setExit(doc, b);
  const before = JSON.stringify(graphIn(doc));
  const undo = undoOf(doc);
  setExit(doc, c);
  expect(undo.undoStack).toHaveLength(1);
  undo.undo();
  expect(JSON.stringify(graphIn(doc))).toBe(before);
});

/** Returns the names of the actions that this action waits for. */
const waitsFor = (doc: Y.Doc, key: Key): string[] =>
  graphIn(doc)
    .relations.filter(
      ({ child, parent, required }) => child === key && parent !== ENTRY && required,
    )
    .map(({ parent }) => actionIn(doc, parent)?.name ?? "")
    .sort();

test("an action after both branches of a decision waits for neither", () => {
  const [doc, , b, c] = decided();
  const d = addAction(doc, { name: "D" });
  connect(doc, b, d);
  expect(waitsFor(doc, d)).toEqual(["B"]);
  connect(doc, c, d);
  expect(waitsFor(doc, d)).toEqual([]);
});

test("an action after all branches of a fork waits for all, also with a decision behind it", () => {
  const [doc, a, b, c] = docWith("A", "B", "C") as Three;
  const [d, e, f] = ["D", "E", "F"].map((name) => addAction(doc, { name })) as [Key, Key, Key];
  setEntry(doc, a);
  for (const key of [b, c]) connect(doc, a, key);
  for (const key of [b, c]) connect(doc, key, d);
  connect(doc, d, e, "on_true");
  connect(doc, d, f, "on_false");
  setExit(doc, e);
  setExit(doc, f);
  expect([waitsFor(doc, d), waitedFor(doc)]).toEqual([["B", "C"], []]);
});

test("an arrow back is not waited for, whether it is drawn before the way in or after it", () => {
  for (const isFirst of [true, false]) {
    const [doc, a, b, c] = docWith("A", "B", "C") as Three;
    setEntry(doc, a);
    const back = () => connect(doc, c, b, "on_false");
    if (isFirst) back();
    connect(doc, b, c);
    connect(doc, a, b);
    if (!isFirst) back();
    setExit(doc, c);
    expect([waitsFor(doc, b), waitedFor(doc)]).toEqual([["A"], ["C"]]);
  }
});

test("a handler of errors leads to the end beside the usual way, and neither is waited for", () => {
  const [doc, a, b, handler] = docWith("A", "B", "Handler") as Three;
  setEntry(doc, a);
  connect(doc, a, b);
  setExit(doc, b);
  for (const key of [a, b]) connect(doc, key, handler, "on_error");
  setExit(doc, handler);
  expect([waitsFor(doc, handler), waitedFor(doc)]).toEqual([[], []]);
});

test("an arrow that stops another action does not keep it from starting", () => {
  const [doc, a, b, c] = docWith("A", "B", "C") as Three;
  setEntry(doc, a);
  for (const key of [b, c]) connect(doc, a, key);
  connect(doc, b, c, "on_true", "stop");
  expect(waitsFor(doc, c)).toEqual(["A"]);
});

test("an edit elsewhere leaves what a file or a person has chosen otherwise", () => {
  const [doc, , b, c] = decided();
  const d = addAction(doc, { name: "D" });
  connect(doc, b, d);
  const id = connect(doc, c, d) as string;
  setRequired(doc, id, true);
  connect(doc, d, addAction(doc, { name: "E" }));
  expect(waitsFor(doc, d)).toEqual(["C"]);
});

const LOTS = Number(process.env.DRAWN_GRAPHS ?? "0");

test("the graphs that tests/umrf/test_drawn_graphs.py plays are those that gestures draw", async () => {
  const graphs = fc.sample(gestures, { seed: 20261128, numRuns: LOTS || 60 });
  const drawn = graphs
    .map((each) => arrowsOf(drawnBy(each)))
    .filter((each) => !goesInCircles(each));
  const lines = drawn.map((each) => JSON.stringify(each));
  const file = LOTS ? (process.env.DRAWN_FILE ?? "") : "../../../../tests/vectors/drawn.json";
  await expect(`[\n${lines.join(",\n")}\n]\n`).toMatchFileSnapshot(file);
}, 120_000);
