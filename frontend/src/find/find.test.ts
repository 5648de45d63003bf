import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setRemap, setRequired } from "../graph/edit";
import { readGraph } from "../graph/read";
import { find } from "./find";

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
