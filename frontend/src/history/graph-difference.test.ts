import { expect, test } from "vitest";
import { EMPTY_GRAPH, ENGINE_DEFAULTS, type Graph, type Relation } from "../graph/model";
import { anyAction } from "../testing/graphs";
import { changesBetween, countWords, walkOrder } from "./graph-difference";

const value = (path: string, is: number) => ({
  path,
  text: JSON.stringify({ pvf_type: "number", pvf_value: is }),
});
const arrow = (parent: string, child: string, more: Partial<Relation> = {}): Relation => ({
  ...{ parent, child, listing: 0, conditions: ENGINE_DEFAULTS, required: true, remap: [] },
  ...{ only: null, parentOrder: 0, childOrder: 0, parentsExtra: [], childrenExtra: [] },
  waypoints: [],
  ...more,
});
const graph = (more: Partial<Graph>): Graph => ({ ...EMPTY_GRAPH, ...more });
const nobody = () => null;

const before = graph({
  actions: [anyAction("a", [value("torque", 12.5)]), anyAction("b"), anyAction("c")],
  relations: [arrow("a", "b"), arrow("a", "c")],
  notes: [["n", "{}"]],
});
const after = graph({
  name: "valves",
  actions: [
    anyAction("a", [value("torque", 85)]),
    { ...anyAction("c"), position: [5, 5] },
    anyAction("d"),
  ],
  relations: [arrow("a", "c", { waypoints: [["run", "[]"]] }), arrow("c", "d")],
});

test("what came, went and changed, and what only looks otherwise", () => {
  const { things } = changesBetween(before, after, nobody);
  const told = things.map(({ key, change, looks }) => `${key} ${looks ? "looks" : change}`);
  expect(told.sort()).toEqual(
    ["a changed", "b removed", "c looks", "d added"]
      .concat(["a>b removed", "a>c looks", "c>d added", "g/n removed", " changed"])
      .sort(),
  );
  expect(countWords(things, "removed")).toBe("1 card, 1 arrow, 1 note");
  expect(countWords(things, "changed")).toBe("1 card, the graph");
  expect(walkOrder(things).at(-1)?.looks).toBe(true);
});

test("what is gone is drawn where it stood, and values say what they were", () => {
  const { shown, marks } = changesBetween(before, after, (key) => (key === "a" ? "Ada" : null));
  expect(shown.actions.map(({ key }) => key)).toEqual(["a", "c", "d", "b"]);
  expect(marks.get("a")).toEqual({
    change: "changed",
    by: "Ada",
    oldName: null,
    oldValues: new Map([["torque", "12.5"]]),
  });
  expect(marks.has("c")).toBe(false);
});

test("a note that is moved says the same", () => {
  const note = (text: string, x: number) =>
    JSON.stringify({ kind: "note", text, at: [x, 0], size: [100, 60], color: "amber" });
  const noted = (text: string, x: number) => graph({ notes: [["n", note(text, x)]] });
  const told = (was: Graph, is: Graph) => changesBetween(was, is, nobody).things[0];
  expect(told(noted("a", 1), noted("a", 2))).toMatchObject({ looks: true });
  expect(told(noted("a", 1), noted("b", 1))).toMatchObject({ looks: false, name: "b" });
});

test("where nothing differs the graph is the same one", () => {
  const { shown, things } = changesBetween(before, before, nobody);
  expect(shown).toBe(before);
  expect(things).toEqual([]);
});
