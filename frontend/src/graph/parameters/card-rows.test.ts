import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../document-keys";
import { addAction, connect, setRemap } from "../edit";
import type { Parameter } from "../model";
import { readGraph } from "../read";
import { cardRows } from "./card-rows";
import { dataFlowOf } from "./data-flow";

const input = (path: string, type: string, value?: string) => ({
  path,
  text: `{"pvf_type": "${type}"${value === undefined ? "" : `, "pvf_value": ${value}`}}`,
});

/** Look gives an angle and a colour to Grip, the colour as paint. */
function grip() {
  const doc = new Y.Doc();
  const outputs = [input("angle", "number"), input("colour", "string")];
  const look = addAction(doc, { name: "Look", outputs });
  const inputs = [
    input("force", "number"),
    input("valve", "string", '"valve_7"'),
    ...["x", "y", "z"].map((axis, i) =>
      input(`at/${axis}`, "number", i < 2 ? `0.${i}` : undefined),
    ),
    input("angle", "number"),
    input("paint", "string"),
  ];
  const key = addAction(doc, { name: "Grip", inputs });
  connect(doc, look, key);
  setRemap(doc, `${look}>${key}`, "colour", "paint");
  const graph = readGraph(mapsOf(doc));
  const action = graph.actions.find((each) => each.key === key);
  return { inputs: action?.inputs ?? [], givers: dataFlowOf(graph).get(key) };
}

const told = (rows: ReturnType<typeof cardRows>) =>
  rows.map(({ name, kind, text }) => `${name} ${kind} ${text}`);

test("a card has a row for each input, one for a point, and what waits for a value last", () => {
  const { inputs, givers } = grip();
  expect(told(cardRows(inputs, givers))).toEqual([
    "valve value valve_7",
    "at value 0.0 0.1 ?",
    "angle from Look",
    "paint from Look.colour",
    "force open ?",
  ]);
});

test("an input that needs no value is nothing to fill in, and comes last", () => {
  const empty = (path: string, required: boolean) => ({
    path,
    text: JSON.stringify({ pvf_type: "number", pvf_required: required }),
  });
  const inputs = [empty("deadline_s", false), empty("load", true)] as Parameter[];
  expect(told(cardRows(inputs))).toEqual(["load open ?", "deadline_s none no value"]);
});

test("in a run the values that were reported stand in their place, and only those", () => {
  const { inputs, givers } = grip();
  const rows = cardRows(inputs, givers, { angle: "2.50", paint: '"red"' });
  expect(told(rows).slice(2, 4)).toEqual(["angle seen 2.50", "paint seen red"]);
  expect(told(rows)[0]).toBe("valve value valve_7");
});
