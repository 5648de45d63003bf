import fc from "fast-check";
import { expect, test } from "vitest";
import type * as Y from "yjs";
import { actionIn, docWith, graphIn } from "../../testing/edited-graph";
import { EXIT, type Key, type Precondition } from "../model";
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
  expect(waitedFor(doc)).toEqual(["D"]); // nothing leads to D yet, so nothing is known of it
  setEntry(doc, d);
  expect(waitedFor(doc)).toEqual(["B", "C", "D"]);
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

function reachedFrom(
  start: Key,
  arrows: readonly (readonly [number, number, string])[],
  keys: Key[],
) {
  const reached = new Set([start]);
  for (const key of reached) {
    for (const [from, to] of arrows) if (keys[from] === key && to < 4) reached.add(keys[to] as Key);
  }
  return reached;
}

test("however it is drawn, the end waits for all or none that is reached, and for all beside a fork", () => {
  const outcome = fc.constantFrom<Precondition>("on_true", "on_false", "on_error");
  const place = fc.integer({ min: 0, max: 3 });
  const drawn = fc.array(fc.tuple(place, fc.integer({ min: 0, max: 4 }), outcome), {
    minLength: 3,
    maxLength: 14,
  });
  fc.assert(
    fc.property(drawn, (arrows) => {
      const [doc, ...keys] = docWith("A", "B", "C", "D") as [Y.Doc, ...Key[]];
      setEntry(doc, keys[0] as Key);
      for (const [from, to, when] of arrows) {
        connect(doc, keys[from] as Key, to === 4 ? EXIT : (keys[to] as Key), when);
      }
      const asked = new Set<string>();
      let forks = false;
      for (const { parent, conditions } of graphIn(doc).relations) {
        for (const when of ["on_true", "on_false", "on_error"] as const) {
          if (parent === "entry" || conditions[when] === "ignore") continue;
          forks ||= asked.has(parent + when);
          asked.add(parent + when);
        }
      }
      const ends = graphIn(doc).relations.filter(({ child }) => child === EXIT);
      const waited = ends.filter(({ required }) => required);
      if (forks || ends.length < 2) {
        expect(waited).toHaveLength(ends.length);
        return;
      }
      const reached = reachedFrom(keys[0] as Key, arrows, keys);
      const certain = ends.filter(({ parent }) => reached.has(parent));
      expect([0, certain.length]).toContain(certain.filter(({ required }) => required).length);
    }),
    {
      examples: [
        // The last one leads to the end before anything leads to it: nothing is known of it yet.
        [
          [
            [2, 4, "on_true"],
            [0, 4, "on_false"],
            [0, 1, "on_true"],
            [1, 2, "on_true"],
            [3, 4, "on_true"],
          ],
        ],
      ],
    },
  );
});
