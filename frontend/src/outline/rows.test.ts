import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setEntry, setExit, setResponse } from "../graph/edit";
import { writeNote } from "../graph/edit/notes";
import { type Graph, PRECONDITIONS } from "../graph/model";
import { readGraph } from "../graph/read";
import { bundlesOf, inOrder, leadingNowhere, namesOf, type OutlineItem, rowsOf } from "./rows";

const read = (doc: Y.Doc) => readGraph(mapsOf(doc));
const all = () => true;

function words(graph: Graph, row: OutlineItem): string {
  const name = (key: string) => graph.actions.find((a) => a.key === key)?.name ?? key;
  switch (row.kind) {
    case "entry":
      return "entry";
    case "action":
      return row.action.name;
    case "outcome":
      return row.outcome;
    case "target":
      return `${row.response} ${name(row.relation.child)}`;
    case "note":
      return row.note.text;
    case "inside":
      return row.part.action.name;
  }
}

test("graphs expanded in an action stand below it, each level below its own", () => {
  const doc = new Y.Doc();
  const fetch = addAction(doc, { name: "Fetch" });
  const graph = read(doc);
  const part = (path: string, name: string) => {
    const [action] = graph.actions;
    if (!action) throw new Error("no action");
    const box = { x: 0, y: 0, width: 208, height: 88, progress: null, expanded: false };
    return { ...box, path, action: { ...action, name } };
  };
  const parts = [
    part(`${fetch}/grip`, "Grip"),
    part(`${fetch}/grip/close`, "Close"),
    part(`${fetch}/lift`, "Lift"),
  ];
  const rows = rowsOf(graph, all, (key) => (key === fetch ? parts : []));
  expect(rows.map((row) => [row.level, words(graph, row), row.parent, row.at, row.of])).toEqual([
    [1, "entry", null, 1, 2],
    [1, "Fetch", null, 2, 2],
    [2, "Grip", fetch, 1, 2],
    [3, "Close", `${fetch}/grip`, 1, 1],
    [2, "Lift", fetch, 2, 2],
  ]);
});

test("the outline follows the run, loops once, and forgets nobody", () => {
  const doc = new Y.Doc();
  const last = addAction(doc, { name: "Last" });
  const first = addAction(doc, { name: "First" });
  addAction(doc, { name: "Alone" });
  setEntry(doc, first);
  connect(doc, first, last);
  connect(doc, last, first, "on_false");
  expect(inOrder(read(doc)).map(({ name }) => name)).toEqual(["First", "Last", "Alone"]);
});

test("an action has its outcomes under it, and each what follows it", () => {
  const doc = new Y.Doc();
  const look = addAction(doc, { name: "Look" });
  const grip = addAction(doc, { name: "Grip" });
  setEntry(doc, look);
  connect(doc, look, grip);
  setExit(doc, look, "on_error");
  const graph = read(doc);
  expect(rowsOf(graph, all).map((row) => [row.level, words(graph, row)])).toEqual([
    [1, "entry"],
    [2, "run Look"],
    [1, "Look"],
    [2, "on_true"],
    [3, "run Grip"],
    [2, "on_error"],
    [3, "run exit"],
    [1, "Grip"],
  ]);
  expect(rowsOf(graph, () => false).map((row) => words(graph, row))).toEqual([
    "entry",
    "Look",
    "Grip",
  ]);
});

test("an arrow that ignores everything can be found and changed", () => {
  const doc = new Y.Doc();
  const look = addAction(doc, { name: "Look" });
  const id = connect(doc, look, addAction(doc, { name: "Grip" })) ?? "";
  setResponse(doc, id, "on_true", "ignore");
  const graph = read(doc);
  expect(rowsOf(graph, all).map((row) => words(graph, row))).toContain("ignore Grip");
});

test("every row has its place in the tree, whatever is drawn", () => {
  const arrow = fc.tuple(fc.nat(4), fc.nat(4), fc.nat(3));
  fc.assert(
    fc.property(fc.array(arrow, { maxLength: 12 }), fc.boolean(), (arrows, open) => {
      const doc = new Y.Doc();
      const keys = [0, 1, 2, 3, 4].map((n) => addAction(doc, { name: `A${n}` }));
      for (const [from, to, outcome] of arrows) {
        connect(doc, keys[from] ?? "", keys[to] ?? "", PRECONDITIONS[outcome]);
      }
      writeNote(doc, { kind: "note", at: [0, 0], size: [200, 80], text: "", color: "grey" });
      const rows = rowsOf(read(doc), () => open);
      const ids = rows.map(({ id }) => id);
      expect(new Set(ids).size).toBe(ids.length);
      for (const row of rows) {
        const siblings = rows.filter(({ parent }) => parent === row.parent);
        expect(row.of).toBe(siblings.length);
        expect(siblings[row.at - 1]).toBe(row);
        if (row.parent !== null) expect(ids.indexOf(row.parent)).toBeLessThan(ids.indexOf(row.id));
      }
    }),
  );
});

test("outcomes that say the same to the same action are one bundle", () => {
  const doc = new Y.Doc();
  const [look, grip, call] = ["Look", "Grip", "Call"].map((name) => addAction(doc, { name }));
  if (!look || !grip || !call) throw new Error("not added");
  setEntry(doc, look);
  connect(doc, look, grip);
  connect(doc, look, call, "on_false");
  connect(doc, look, call, "on_error");
  const stops = connect(doc, grip, look) ?? "";
  setResponse(doc, stops, "on_false", "stop");
  const graph = read(doc);
  const said = (key: string) =>
    bundlesOf(graph)
      .get(key)
      ?.map((row) => [row.bundled?.join(" "), words(graph, row)]);
  expect(said("entry")).toEqual([["", "run Look"]]);
  expect(said(look)).toEqual([
    ["on_true", "run Grip"],
    ["on_false on_error", "run Call"],
  ]);
  expect(said(grip)).toEqual([
    ["on_true", "run Look"],
    ["on_false", "stop Look"],
  ]);
  expect(leadingNowhere(bundlesOf(graph).get(grip) ?? [])).toEqual(["on_error"]);
  expect(leadingNowhere([])).toEqual(["on_true", "on_false", "on_error"]);
});

test("every outcome that is answered is in exactly one bundle", () => {
  const arrow = fc.tuple(fc.nat(2), fc.nat(2), fc.nat(3), fc.constantFrom("run", "stop", "pause"));
  fc.assert(
    fc.property(fc.array(arrow, { maxLength: 12 }), (arrows) => {
      const doc = new Y.Doc();
      const keys = [0, 1, 2].map((n) => addAction(doc, { name: `A${n}` }));
      for (const [from, to, outcome, response] of arrows) {
        const id = connect(doc, keys[from] ?? "", keys[to] ?? "", PRECONDITIONS[outcome]);
        if (id) setResponse(doc, id, PRECONDITIONS[outcome] ?? "on_true", response);
      }
      const graph = read(doc);
      const bundles = [...bundlesOf(graph).values()].flat();
      const spoken = graph.relations.flatMap((relation) =>
        PRECONDITIONS.filter((outcome) => relation.conditions[outcome] !== "ignore"),
      );
      expect(bundles.flatMap(({ bundled = [] }) => bundled)).toHaveLength(spoken.length);
      expect(new Set(bundles.map(({ id }) => id)).size).toBe(bundles.length);
    }),
  );
});

test("rows of a phone call ready-made actions as their cards do", () => {
  const doc = new Y.Doc();
  for (const name of ["AaConfirm", "Grip", "Grip"]) addAction(doc, { name });
  const names = [...namesOf(read(doc)).values()];
  expect(names).toEqual(["Entry", "Exit", "Confirm", "Grip 0", "Grip 1"]);
});
