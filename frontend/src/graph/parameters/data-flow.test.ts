import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../document-keys";
import { addAction, connect, setRemap, setResponse } from "../edit";
import { leaveOutputs, takeOutputs } from "../edit/parameters";
import { readGraph } from "../read";
import { dataFlowOf, touchedBy } from "./data-flow";
import { handedOver } from "./handed-over";
import { groupChoices, outputChoices } from "./output-choices";

const file = new URL("../../../../tests/vectors/handed-over.json", import.meta.url);
type HandedOverVector = [
  outputs: string[],
  remap: [string, string][],
  inputs: string[],
  found: Record<string, string> | null,
];
const vectors = JSON.parse(readFileSync(fileURLToPath(file), "utf8")) as HandedOverVector[];

test("outputs reach inputs as the engine finds them, also where renaming breaks its order", () => {
  for (const [outputs, remap, inputs, found] of vectors) {
    const renamings = remap.map(([source, target]) => ({ source, target }));
    const reached = handedOver(outputs, renamings, inputs);
    expect(reached && Object.fromEntries(reached)).toEqual(found);
  }
});

const parameter = (path: string, type: string, more = "") => ({
  path,
  text: `{"pvf_type": "${type}"${more}}`,
});

/** Look → Grip → Drop, and Elsewhere, which leads nowhere. */
function drawn() {
  const doc = new Y.Doc();
  const outputs = [parameter("angle", "number"), parameter("colour", "string")];
  const look = addAction(doc, { name: "Look", outputs });
  const inputs = [
    parameter("angle", "number"),
    parameter("turn", "number"),
    parameter("paint", "string", ', "pvf_updatable": false'),
  ];
  const grip = addAction(doc, { name: "Grip", inputs, outputs: [parameter("width", "number")] });
  const drop = addAction(doc, { name: "Drop", inputs: [parameter("angle", "string")] });
  const elsewhere = addAction(doc, { name: "Elsewhere", outputs: [parameter("angle", "number")] });
  connect(doc, look, grip);
  connect(doc, grip, drop);
  const graph = () => readGraph(mapsOf(doc));
  return { doc, look, grip, drop, elsewhere, graph };
}

const givers = (flow: ReturnType<typeof dataFlowOf>, key: string) =>
  [...(flow.get(key) ?? [])].map(([path, list]) => [path, list.map((each) => each.output)]);

test("an output reaches the input of its name, unless the arrow ignores every end", () => {
  const { doc, look, grip, graph } = drawn();
  expect(givers(dataFlowOf(graph()), grip)).toEqual([["angle", ["angle"]]]);
  setRemap(doc, `${look}>${grip}`, "angle", "turn");
  expect(givers(dataFlowOf(graph()), grip)).toEqual([["turn", ["angle"]]]);
  setResponse(doc, `${look}>${grip}`, "on_error", "run");
  setResponse(doc, `${look}>${grip}`, "on_true", "ignore");
  expect(dataFlowOf(graph()).get(grip)?.size).toBe(1);
  setResponse(doc, `${look}>${grip}`, "on_error", "bypass");
  expect(dataFlowOf(graph()).size).toBe(0);
});

test("the givers of an action stay the same object while none of them changes", () => {
  const { grip, graph } = drawn();
  const now = graph();
  expect(dataFlowOf(now).get(grip)).toBe(dataFlowOf({ ...now }).get(grip));
});

test("only what fits and precedes can be taken; the rest says why not", () => {
  const { grip, look, graph } = drawn();
  const now = graph();
  const action = now.actions.find(({ key }) => key === grip);
  if (!action) throw new Error("no Grip");
  const choices = outputChoices(now, action, "turn", []);
  expect(choices.map((each) => [each.parentName, each.output, each.reason])).toEqual([
    ["Look", "angle", null],
    ["Look", "colour", "takes number, not string"],
    ["Grip", "width", "is its own output"],
    ["Elsewhere", "angle", "does not come before"],
  ]);
  const locked = outputChoices(now, action, "paint", []);
  expect(locked.find(({ output }) => output === "colour")?.reason).toBe("is locked");
  const drop = now.actions.find(({ name }) => name === "Drop");
  const far = drop && outputChoices(now, drop, "angle", []);
  expect(far?.find(({ parent, output }) => parent === look && output === "colour")?.reason).toBe(
    "no arrow leads from there to here",
  );
});

test("an output that others would be lost for is not offered", () => {
  const doc = new Y.Doc();
  const outputs = ["a", "b", "c"].map((name) => parameter(name, "number"));
  const inputs = ["b", "c", "z"].map((name) => parameter(name, "number"));
  const [from, to] = [
    addAction(doc, { name: "A", outputs }),
    addAction(doc, { name: "B", inputs }),
  ];
  connect(doc, from, to);
  const graph = readGraph(mapsOf(doc));
  const action = graph.actions.find(({ key }) => key === to);
  const choices = action ? outputChoices(graph, action, "z", []) : [];
  const reasons = new Map(choices.map(({ output, reason }) => [output, reason]));
  const expected = handedOver(["a", "b", "c"], [{ source: "a", target: "z" }], ["b", "c", "z"]);
  expect(expected?.has("b") && expected.has("c")).toBe(reasons.get("a") === null);
  expect(reasons.get("c")).toBeNull();
});

test("taking an output renames it where names differ, and leaving it takes the renaming away", () => {
  const { doc, look, grip, graph } = drawn();
  const remaps = () => graph().relations.find(({ parent }) => parent === look)?.remap;
  expect(takeOutputs(doc, `${look}>${grip}`, [{ output: "angle", input: "turn" }])).toBe(true);
  expect(remaps()).toEqual([{ source: "angle", target: "turn" }]);
  expect(takeOutputs(doc, `${look}>${grip}`, [{ output: "angle", input: "angle" }])).toBe(true);
  expect(remaps()).toEqual([]);
  expect(leaveOutputs(doc, grip, ["angle"])).toBe(false);
});

test("a parameter ties its action to those that give it and take it", () => {
  const { look, grip, graph } = drawn();
  const flow = dataFlowOf(graph());
  expect(touchedBy(flow, grip, "in", "angle")).toEqual({ producers: [look], consumers: [grip] });
  expect(touchedBy(flow, look, "out", "angle")).toEqual({ producers: [look], consumers: [grip] });
});

test("a pose is taken whole from an action that gives one", () => {
  const doc = new Y.Doc();
  const axes = ["x", "y", "z"].map((axis) => `position/${axis}`);
  const pose = (head: string) => axes.map((axis) => parameter(`${head}/${axis}`, "number"));
  const see = addAction(doc, { name: "See", outputs: [...pose("seen"), parameter("x", "number")] });
  const grip = addAction(doc, { name: "Grip", inputs: pose("at") });
  connect(doc, see, grip);
  const graph = () => readGraph(mapsOf(doc));
  const action = graph().actions.find(({ key }) => key === grip);
  const [choice, ...others] = action ? groupChoices(graph(), action, "at/", "pose", []) : [];
  expect([choice?.output, choice?.reason, others]).toEqual(["seen", null, []]);
  takeOutputs(doc, `${see}>${grip}`, choice?.ties ?? []);
  const found = dataFlowOf(graph()).get(grip);
  expect([...(found?.values() ?? [])].map(([giver]) => giver?.output)).toEqual(
    axes.map((axis) => `seen::${axis.replace("/", "::")}`),
  );
});
