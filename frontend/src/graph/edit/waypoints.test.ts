import { expect, test } from "vitest";
import type * as Y from "yjs";
import {
  actionIn,
  copyOf,
  docWith,
  exchange,
  graphIn,
  relationIn,
  updatesOf,
} from "../../testing/edited-graph";
import { changesOf } from "../changes";
import { mapsOf, rootOf } from "../document-keys";
import type { Key, Position } from "../model";
import { readWaypoints } from "../waypoints";
import {
  connect,
  insertInto,
  moveActions,
  moveRelation,
  removeActions,
  removeRelation,
  retarget,
  setResponse,
  undoOf,
} from ".";
import { clipOf, paste } from "./clip";
import { setWaypoints, straighten } from "./waypoints";

/** Two actions with a line that is bent once. */
function bent(): { doc: Y.Doc; a: Key; b: Key; id: string } {
  const [doc, a = "", b = ""] = docWith("A", "B");
  const id = connect(doc, a, b) ?? "";
  moveActions(doc, [
    [a, [0, 0]],
    [b, [480, 0]],
  ]);
  setWaypoints(doc, `${id}|run`, [[240.4, -83.6]]);
  return { doc, a, b, id };
}
const said = (doc: Y.Doc, id: string | null) => relationIn(doc, id)?.waypoints;
const keys = (doc: Y.Doc) => [...rootOf(doc, "positions").keys()].filter((k) => k.startsWith("w/"));

test("a bend is one edit, on whole pixels, and undo takes it back", () => {
  const { doc, id } = bent();
  const undo = undoOf(doc);
  expect(said(doc, id)).toEqual([["run", "[[240,-84]]"]]);
  const move = () =>
    setWaypoints(doc, `${id}|run`, [
      [0, 1],
      [2, 3],
    ]);
  expect(updatesOf(doc, move)).toBe(1);
  undo.undo();
  expect(said(doc, id)).toEqual([["run", "[[240,-84]]"]]);
  setWaypoints(doc, `${id}|run`, []);
  expect(keys(doc)).toEqual([]);
});

test("only existing lines can be bent, and at most eight times", () => {
  const { doc, a, b, id } = bent();
  const nine = Array.from({ length: 9 }, (_, i): Position => [i, i]);
  expect(setWaypoints(doc, `${id}|run`, nine)).toBe(false);
  expect(setWaypoints(doc, `${b}>${a}|run`, [[1, 1]])).toBe(false);
  expect(keys(doc)).toEqual([`w/${id}|run`]);
});

test.each([
  "",
  "{}",
  "[[1]]",
  "[[1,2],7]",
  '[["1",2]]',
  "[[1e9,0]]",
  `[${"[1,2],".repeat(8)}[1,2]]`,
])("what is no waypoint bends nothing and stays: %s", (text) => {
  const { doc, id } = bent();
  rootOf(doc, "positions").set(`w/${id}|run`, text);
  expect(readWaypoints(text)).toEqual([]);
  const relation = relationIn(doc, id);
  if (relation) straighten(doc, [relation]);
  expect(rootOf(doc, "positions").get(`w/${id}|run`)).toBe(text);
});

test("bends go with their arrow and come back with it, also with its action", () => {
  for (const remove of [
    ({ doc, id }: ReturnType<typeof bent>) => removeRelation(doc, id),
    ({ doc, b }: ReturnType<typeof bent>) => removeActions(doc, [b]),
  ]) {
    const graph = bent();
    const undo = undoOf(graph.doc);
    expect(updatesOf(graph.doc, () => remove(graph))).toBe(1);
    expect(keys(graph.doc)).toEqual([]);
    undo.undo();
    expect(said(graph.doc, graph.id)).toEqual([["run", "[[240,-84]]"]]);
  }
});

test("a line that says something else keeps its bends; one that is gone loses them", () => {
  const { doc, id } = bent();
  setResponse(doc, id, "on_true", "stop");
  expect(said(doc, id)).toEqual([["stop", "[[240,-84]]"]]);
  setResponse(doc, id, "on_false", "run");
  expect(said(doc, id)).toEqual([["stop", "[[240,-84]]"]]);
  setResponse(doc, id, "on_true", "ignore");
  expect(said(doc, id)).toEqual([]);
});

test("a line that is led elsewhere keeps its bends; one that takes in an action does not", () => {
  const { doc, a, b, id } = bent();
  const [c, d] = ["C", "D"].map((name) => paste(doc, clipWith(name), { at: [0, 300] })[0] ?? "");
  const moved = moveRelation(doc, id, { child: c ?? "" });
  expect(said(doc, moved)).toEqual([["run", "[[240,-84]]"]]);
  const back = retarget(doc, moved ?? "", "on_true", { child: b });
  expect(said(doc, back)).toEqual([["run", "[[240,-84]]"]]);
  insertInto(doc, back ?? "", d ?? "");
  expect([said(doc, `${a}>${d}`), keys(doc)]).toEqual([[], []]);
});

const clipWith = (name: string) => {
  const [doc, key = ""] = docWith(name);
  return clipOf(doc, new Set([key]), new Map([[key, [0, 0]]]));
};

test("an arrow that is drawn anew has no bends of one before", () => {
  const { doc, a, b, id } = bent();
  const other = copyOf(doc);
  removeRelation(doc, id);
  setWaypoints(other, `${id}|run`, [[1, 1]]);
  exchange(doc, other);
  expect(keys(doc)).toEqual([`w/${id}|run`]);
  connect(doc, a, b);
  expect(said(doc, id)).toEqual([]);
});

test("bends move when both ends move together, and stay when one does", () => {
  const { doc, a, b, id } = bent();
  moveActions(doc, [
    [a, [10, 20]],
    [b, [490, 20]],
  ]);
  expect(said(doc, id)).toEqual([["run", "[[250,-64]]"]]);
  moveActions(doc, [[a, [10, 60]]]);
  moveActions(doc, [
    [a, [0, 60]],
    [b, [490, 50]],
  ]);
  expect(said(doc, id)).toEqual([["run", "[[250,-64]]"]]);
});

test("copies have the bends of the arrows between them, moved as they are", () => {
  const { doc, a, b } = bent();
  const places = new Map<Key, Position>([
    [a, [0, 0]],
    [b, [480, 0]],
  ]);
  const [c, d] = paste(doc, clipOf(doc, new Set([a, b]), places), { by: [40, 40] });
  expect(said(doc, `${c}>${d}`)).toEqual([["run", "[[280,-44]]"]]);
  expect(actionIn(doc, c ?? "")?.position).toEqual([40, 40]);
  expect(clipOf(doc, new Set([a]), places).positions).toEqual({ [a]: [0, 0] });
});

test("a bend is a change of its arrow, in words", () => {
  const { doc, id } = bent();
  const before = mapsOf(doc);
  setWaypoints(doc, `${id}|run`, [
    [1, 2],
    [3, 4],
  ]);
  const here = mapsOf(doc);
  const none = new Map<string, unknown>();
  const difference = {
    ...{ meta: none, actions: none, relations: none, comments: none },
    positions: new Map([[`w/${id}|run`, here.positions.get(`w/${id}|run`)]]),
  };
  const [change] = changesOf({ difference, before, here }, before);
  expect([change?.thing, change?.kind, change?.title]).toEqual(["arrow", "changed", "A → B"]);
  expect(change?.lines).toEqual([{ field: "Bends", before: "1 by hand", after: "2 by hand" }]);
});

test("a graph that follows its document has only that arrow anew", () => {
  const { doc, id } = bent();
  const before = graphIn(doc);
  setWaypoints(doc, `${id}|run`, [[5, 5]]);
  expect(graphIn(doc).actions).toEqual(before.actions);
  expect(said(doc, id)).toEqual([["run", "[[5,5]]"]]);
});
