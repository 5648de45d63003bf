import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf, noteKey } from "../document-keys";
import { ENTRY, EXIT, fullName, type Graph } from "../model";
import { readGraph } from "../read";
import { umrfText } from "../umrf-text";
import {
  addAction,
  addNote,
  connect,
  removeActions,
  setEntry,
  setExit,
  setRemap,
  setRequired,
  setResponse,
  undoOf,
} from ".";
import { clipOf, copyNameOf, paste } from "./clip";

const graphOf = (doc: Y.Doc) => readGraph(mapsOf(doc));

function drawn() {
  const doc = new Y.Doc();
  const a = addAction(doc, {
    name: "Check",
    actor: "atlas",
    inputs: [{ path: "min", text: '{"pvf_type": "number", "pvf_value": 5.0}' }],
    outputs: [{ path: "level", text: '{"pvf_type": "number"}' }],
    position: [100, 50],
  });
  const b = addAction(doc, { name: "Drive", position: [100, 250] });
  const c = addAction(doc, { name: "Check", position: [400, 250] });
  setEntry(doc, a);
  const arrow = connect(doc, a, b) ?? "";
  setResponse(doc, arrow, "on_error", "bypass");
  setRequired(doc, arrow, false);
  setRemap(doc, arrow, "level", "speed");
  connect(doc, b, b, "on_false");
  connect(doc, b, c);
  setExit(doc, b);
  return { doc, a, b, c };
}

/** Arrows by the names of their ends, with all they say. */
const said = (graph: Graph) => {
  const names = new Map(graph.actions.map((action) => [action.key, action.name]));
  return graph.relations
    .map(({ parent, child, conditions, required, remap }) => ({
      from: names.get(parent) ?? parent,
      to: names.get(child) ?? child,
      conditions,
      required,
      remap,
    }))
    .sort((x, y) => JSON.stringify(x).localeCompare(JSON.stringify(y)));
};

test("a copy has the arrows among what was copied, and none that lead out of it", () => {
  const { doc, a, b } = drawn();
  const keys = paste(doc, clipOf(doc, new Set([a, b]), new Map()), { by: [40, 40] });
  const graph = graphOf(doc);
  const [check, drive] = keys.map((key) => graph.actions.find((action) => action.key === key));
  expect([check && fullName(check), drive && fullName(drive)]).toEqual(["Check_2", "Drive_1"]);
  expect(check?.inputs[0]?.text).toBe('{"pvf_type": "number", "pvf_value": 5.0}');
  const touching = graph.relations.filter(
    ({ parent, child }) => keys.includes(parent) || keys.includes(child),
  );
  expect(touching.map(({ parent, child }) => [parent, child]).sort()).toEqual(
    [
      [keys[0], keys[1]],
      [keys[1], keys[1]],
    ].sort(),
  );
  const arrow = touching.find(({ parent }) => parent === keys[0]);
  expect(arrow).toMatchObject({
    required: false,
    conditions: { on_true: "run", on_error: "bypass" },
    remap: [{ source: "level", target: "speed" }],
  });
});

test("pasting is one step of undo", () => {
  const { doc, a, b } = drawn();
  const undo = undoOf(doc);
  const before = graphOf(doc);
  paste(doc, clipOf(doc, new Set([a, b]), new Map()), { at: [0, 0] });
  expect(graphOf(doc).actions).toHaveLength(5);
  undo.undo();
  expect(graphOf(doc)).toEqual(before);
});

test("a paste into an empty graph means the same there, with both ends", () => {
  const { doc } = drawn();
  const whole = {
    actions: Object.fromEntries(mapsOf(doc).actions),
    relations: Object.fromEntries(mapsOf(doc).relations),
    positions: Object.fromEntries(mapsOf(doc).positions),
  };
  const other = new Y.Doc();
  paste(other, whole, { at: [10, 20] });
  expect(said(graphOf(other))).toEqual(said(graphOf(doc)));
  const places = graphOf(other).actions.map(({ position }) => position);
  expect(places).toContainEqual([10, 20]);
  paste(other, whole, { by: [0, 0] });
  const ends = graphOf(other).relations.filter((r) => r.parent === ENTRY || r.child === EXIT);
  expect(ends).toHaveLength(2);
});

test("a note travels with what was chosen", () => {
  const { doc, a } = drawn();
  const note = addNote(doc, '{"kind":"note","at":[100,0],"size":[160,80],"text":"Mind the step"}');
  const keys = paste(doc, clipOf(doc, new Set([a, noteKey(note)]), new Map()), { by: [5, 5] });
  expect(keys).toHaveLength(2);
  const copy = graphOf(doc).notes.find(([id]) => noteKey(id) === keys[1]);
  expect(JSON.parse(copy?.[1] ?? "{}")).toMatchObject({ at: [105, 5], text: "Mind the step" });
});

test("the text of a piece is UMRF with the values as they were spelled", () => {
  const { doc, a, b } = drawn();
  const text = umrfText(graphOf(doc), new Set([a, b]), new Map([[a, [100, 50] as const]]));
  expect(text).toContain('"pvf_value": 5.0');
  const umrf = JSON.parse(text);
  expect(umrf.actions.map((action: { name: string }) => action.name)).toEqual(["Check", "Drive"]);
  expect(umrf.actions[1].parents[0]).toEqual({
    name: "Check",
    instance_id: 0,
    required: false,
    conditions: [
      "on_true -> run",
      "on_false -> ignore",
      "on_error -> bypass",
      "on_stopped -> ignore",
    ],
  });
  expect(umrf.actions[0].children).toEqual([
    { name: "Drive", instance_id: 0, remap: [{ from: "level", to: "speed" }] },
  ]);
});

test("pasting never fails and its additions can be deleted again, whatever the clip holds", () => {
  const key = fc.oneof(
    fc.constantFrom("AAAAAAAAAAAA", "BBBBBBBBBBBB", "entry", "exit"),
    fc.string({ maxLength: 6 }),
  );
  const field = fc.constantFrom("", "|order", "|instance_id", "|missing", "|twin", "|in/a", "|x/b");
  const value = fc.oneof(fc.string(), fc.integer(), fc.boolean(), fc.constant(null));
  const values = (keys: fc.Arbitrary<string>) =>
    fc.array(fc.tuple(keys, value)).map((list) => Object.fromEntries(list));
  const ends = fc.tuple(key, key, fc.constantFrom("|on_true", "|co", "|required", ""));
  const clip = fc.record({
    actions: values(fc.tuple(key, field).map(([k, f]) => k + f)),
    relations: values(ends.map(([p, c, f]) => `${p}>${c}${f}`)),
    positions: values(fc.oneof(key, fc.constant("g/1"))),
  });
  fc.assert(
    fc.property(clip, (some) => {
      const { doc } = drawn();
      const before = graphOf(doc).actions.length;
      const keys = paste(doc, some, { at: [0, 0] });
      const graph = graphOf(doc);
      expect(new Set(graph.actions.map(fullName)).size).toBe(graph.actions.length);
      removeActions(doc, keys);
      expect(graphOf(doc).actions).toHaveLength(before);
    }),
  );
});

test("a copy is called after the version, and like nothing that is there", () => {
  expect(copyNameOf("valves", "v3", ["valves"])).toBe("valves v3");
  expect(copyNameOf("valves", "v3", ["valves v3", "valves v3 2"])).toBe("valves v3 3");
  expect(copyNameOf("", "v3", [])).toBe("untitled v3");
});
