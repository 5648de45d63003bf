import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setRemap, setRequired } from "../graph/edit";
import { readGraph } from "../graph/read";
import { find, findInside } from "./find";

const doc = new Y.Doc();
const drive = addAction(doc, {
  name: "Drive",
  actor: "base",
  description: "to the shelf",
  inputs: [{ path: "goal/x", text: '{"pvf_type": "number", "pvf_value": 5.0}' }],
});
const grip = addAction(doc, { name: "Grip", actor: "arm", type: "spontaneous" });
const id = connect(doc, drive, grip, "on_error", "stop") ?? "";
setRemap(doc, id, "pose", "target");
setRequired(doc, id, false);
const graph = readGraph(mapsOf(doc));
const problem = {
  code: "H6",
  severity: "error" as const,
  where: { aid: grip },
  message: "Nobody grips.",
};

const hits = (query: string) => find(graph, [problem], query).map(({ title }) => title);

test.each([
  ["dri", ["Drive 0"]],
  ["Grip_0", ["Grip 0"]],
  ["shelf", ["Drive 0"]],
  ["goal.x", ["Drive 0"]],
  ["= 5.0", ["Drive 0"]],
  ["spontan", ["Grip 0"]],
  ["h6", ["Grip 0"]],
  ["stop", ["Drive 0 → Grip 0"]],
  ["optional target", ["Drive 0 → Grip 0"]],
  ["robot:arm", ["Grip 0"]],
  ["name:arm", []],
  ["drive arm", []],
  ["", []],
])("%s finds %j", (query, wanted) => {
  expect(hits(query)).toEqual(wanted);
});

test("a hit says what of it was found, unless its name does", () => {
  expect(find(graph, [], "drive")[0]?.why).toBe("");
  expect(find(graph, [], "5.0")[0]?.why).toBe("parameter goal.x = 5.0");
});

test("actions drawn on a card are found at the card, with the levels that lead there", () => {
  const [, inner] = graph.actions;
  if (!inner) throw new Error("no action");
  const box = { x: 0, y: 0, width: 208, height: 88, progress: null, expanded: false };
  const parts = [
    { ...box, path: `${drive}/a`, action: { ...inner, name: "Fetch", actor: "" } },
    { ...box, path: `${drive}/a/b`, action: { ...inner, name: "CloseFingers" } },
  ];
  const partsOf = (key: string) => (key === drive ? parts : []);
  expect(findInside(graph, partsOf, "fingers")).toMatchObject([
    { id: `${drive}/a/b`, title: "CloseFingers 0", keys: [drive], why: "in Drive › Fetch" },
  ]);
  expect(findInside(graph, partsOf, "robot:arm")[0]?.why).toBe("in Drive › Fetch · robot arm");
  expect(findInside(graph, undefined, "fingers")).toEqual([]);
  expect(findInside(graph, partsOf, " ")).toEqual([]);
});
