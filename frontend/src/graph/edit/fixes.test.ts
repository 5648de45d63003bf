import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf, rootOf } from "../document-keys";
import { fullName, type Graph } from "../model";
import { readGraph } from "../read";
import { addAction, addParameter, connect, setField, undoOf } from ".";
import {
  ABOUT,
  applyExamples,
  applyFix,
  applySafeFixes,
  exampleOf,
  FIXES,
  type Fix,
  fixOf,
  safeFixes,
} from "./fixes";

const graphOf = (doc: Y.Doc): Graph => readGraph(mapsOf(doc));

interface Broken {
  doc: Y.Doc;
  a: string;
  b: string;
  arrow: string;
}

/** Two actions and an arrow between them. */
function broken(): Broken {
  const doc = new Y.Doc();
  const a = addAction(doc, { name: "A" });
  const b = addAction(doc, { name: "B" });
  return { doc, a, b, arrow: connect(doc, a, b) ?? "" };
}

/** A graph that needs the fix, and the problem that offers it. */
const cases: Record<Fix, () => { doc: Y.Doc; where: { aid?: string; relation?: string } }> = {
  "mirror-relation": () => {
    const { doc, arrow } = broken();
    rootOf(doc, "relations").set(`${arrow}|only`, "children");
    return { doc, where: { relation: arrow } };
  },
  "not-required": () => {
    const { doc, a, b } = broken();
    return { doc, where: { relation: connect(doc, b, a) ?? "" } };
  },
  "outputs-optional": () => {
    const { doc, a } = broken();
    addParameter(doc, a, "out", "x", '{"pvf_type": "number"}');
    return { doc, where: { aid: a } };
  },
  "remove-relation": () => {
    const { doc, b, arrow } = broken();
    rootOf(doc, "actions").set(`${b}|missing`, true);
    return { doc, where: { relation: arrow } };
  },
  renumber: () => {
    const { doc } = broken();
    const twin = addAction(doc, { name: "A" });
    rootOf(doc, "actions").delete(`${twin}|instance_id`);
    rootOf(doc, "actions").set(`${twin}|twin`, true);
    return { doc, where: { aid: twin } };
  },
  "take-example": () => {
    const { doc, a } = broken();
    addParameter(doc, a, "in", "x~1y", '{"pvf_type": "number", "pvf_example": "2.50"}');
    return { doc, where: { aid: a, path: "/actions/0/input_parameters/x~1y" } };
  },
  "type-sync": () => {
    const { doc, a } = broken();
    setField(doc, a, "type", "");
    return { doc, where: { aid: a } };
  },
};

const found: Record<Fix, (graph: Graph) => boolean> = {
  "mirror-relation": (graph) => graph.relations.every(({ only }) => only === null),
  "not-required": (graph) => graph.relations.some(({ required }) => !required),
  "outputs-optional": (graph) =>
    graph.actions.every(({ outputs }) =>
      outputs.every(({ text }) => text === '{"pvf_type": "number", "pvf_required": false}'),
    ),
  "remove-relation": (graph) => graph.relations.length === 0 && graph.actions.length === 1,
  renumber: (graph) => new Set(graph.actions.map(fullName)).size === graph.actions.length,
  "take-example": (graph) =>
    graph.actions.some(({ inputs }) =>
      inputs.some(({ text }) => text.endsWith('"pvf_example": "2.50", "pvf_value": 2.50}')),
    ),
  "type-sync": (graph) => graph.actions.every(({ type }) => type === "sync"),
};

for (const fix of FIXES) {
  test(`${fix} mends the graph in one step, which undo takes back`, () => {
    const { doc, where } = cases[fix]();
    const before = JSON.stringify(graphOf(doc));
    const undo = undoOf(doc);
    expect(found[fix](graphOf(doc))).toBe(false);
    expect(applyFix(doc, { fix, where })).toBe(true);
    expect(found[fix](graphOf(doc))).toBe(true);
    expect(undo.undoStack).toHaveLength(1);
    undo.undo();
    expect(JSON.stringify(graphOf(doc))).toBe(before);
  });

  test(`${fix} done twice is done once`, () => {
    const { doc, where } = cases[fix]();
    applyFix(doc, { fix, where });
    const once = JSON.stringify(graphOf(doc));
    applyFix(doc, { fix, where });
    expect(JSON.stringify(graphOf(doc))).toBe(once);
  });

  test(`${fix} of something that is gone does nothing`, () => {
    const doc = new Y.Doc();
    expect(applyFix(doc, { fix, where: { aid: "a".repeat(12), relation: "x>y" } })).toBe(false);
    expect(graphOf(doc).actions).toEqual([]);
  });
}

test("a fix that this page does not know, or without its place, is none", () => {
  expect(fixOf({ fix: "rewrite-it-all", where: { aid: "a" } })).toBeNull();
  expect(fixOf({ fix: "renumber", where: { relation: "a>b" } })).toBeNull();
  expect(fixOf({ fix: null, where: {} })).toBeNull();
  expect(fixOf({ where: {} })).toBeNull();
});

test("a number is taken only by actions of the name, and never one that the engine cuts", () => {
  const { doc, a } = broken();
  setField(doc, a, "instanceId", 70_000);
  applyFix(doc, { fix: "renumber", where: { aid: a } });
  expect(graphOf(doc).actions.map(fullName)).toEqual(["A_0", "B_0"]);
  const end = addAction(doc, { name: "graph_exit" });
  applyFix(doc, { fix: "renumber", where: { aid: end } });
  expect(graphOf(doc).actions.map(fullName)).toContain("graph_exit_1");
});

test("every example is taken at once and undone at once, and never along with the safe fixes", () => {
  const { doc, a, b } = broken();
  const leaf = '{"pvf_type": "string", "pvf_example": "left"}';
  const problems = [a, b].map((aid) => {
    addParameter(doc, aid, "in", "to", leaf);
    return { fix: "take-example", where: { aid, path: "/actions/0/input_parameters/to" } };
  });
  expect(safeFixes(problems)).toEqual([]);
  const undo = undoOf(doc);
  expect(applyExamples(doc, problems)).toBe(2);
  expect(applyExamples(doc, problems)).toBe(0);
  const texts = graphOf(doc).actions.flatMap(({ inputs }) => inputs.map(({ text }) => text));
  expect(texts.every((text) => text.endsWith('"pvf_value": "left"}'))).toBe(true);
  undo.undo();
  expect(undo.canUndo()).toBe(false);
});

test("all fixes that lose nothing are applied together and undone together", () => {
  const { doc, arrow, a } = broken();
  rootOf(doc, "relations").set(`${arrow}|only`, "parents");
  setField(doc, a, "type", "");
  const undo = undoOf(doc);
  const problems = [
    { fix: "mirror-relation", where: { relation: arrow } },
    { fix: "mirror-relation", where: { relation: arrow } },
    { fix: "type-sync", where: { aid: a } },
    { fix: "remove-relation", where: { relation: arrow } },
    { where: { aid: a } },
  ];
  expect(safeFixes(problems)).toHaveLength(2);
  expect(applySafeFixes(doc, problems)).toBe(2);
  expect(graphOf(doc).relations).toHaveLength(1);
  undo.undo();
  expect(graphOf(doc).relations[0]?.only).toBe("parents");
  expect(undo.canUndo()).toBe(false);
});

test("a fix that removes something drawn, or makes a value, is never applied unread", () => {
  expect(FIXES.filter((fix) => !ABOUT[fix].safe)).toEqual(["remove-relation", "take-example"]);
});

const file = new URL("../../../../tests/vectors/examples.json", import.meta.url);
const vectors = JSON.parse(readFileSync(fileURLToPath(file), "utf8")) as [string, string | null][];

test.each(vectors)("the example of %s is the value %s", (parameter, value) => {
  expect(exampleOf(parameter)).toBe(value);
});
