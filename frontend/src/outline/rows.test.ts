import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setEntry, setExit, setResponse } from "../graph/edit";
import { writeNote } from "../graph/edit/notes";
import { type Graph, PRECONDITIONS } from "../graph/model";
import { readGraph } from "../graph/read";
import { inOrder, type OutlineItem, rowsOf } from "./rows";

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
  }
}

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
