import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../document-keys";
import { addAction, connect, setEntry, setExit } from "../edit";
import { readGraph } from "../read";
import { interfaceOf } from "./graph-interface";

const open = (path: string, type = "string", more = "") => ({
  path,
  text: `{"pvf_type": "${type}"${more}}`,
});

test("a graph takes what its first actions lack, and gives what its last exit gives", () => {
  const doc = new Y.Doc();
  const valued = { path: "speed", text: '{"pvf_type": "number", "pvf_value": 2}' };
  const drive = addAction(doc, { name: "Drive", inputs: [open("place"), valued] });
  const look = addAction(doc, {
    name: "Look",
    inputs: [open("place"), open("far", "number", ', "pvf_required": false')],
  });
  const grip = addAction(doc, {
    name: "Grip",
    inputs: [open("force", "number")],
    outputs: [open("held", "bool")],
  });
  setEntry(doc, drive);
  setEntry(doc, look);
  connect(doc, drive, grip);
  setExit(doc, grip);
  const { inputs, outputs } = interfaceOf(readGraph(mapsOf(doc)));
  const told = inputs.map(({ path, type, required, mixed }) => [path, type, required, mixed]);
  expect(told.sort()).toEqual([
    ["far", "number", false, false],
    ["place", "string", true, false],
  ]);
  const owners = inputs.find(({ path }) => path === "place")?.of.map(({ key }) => key);
  expect(owners?.sort()).toEqual([drive, look].sort());
  expect(outputs.map(({ path, type }) => [path, type])).toEqual([["held", "bool"]]);
});

test("one name with two types is told, and a graph without arrows takes and gives nothing", () => {
  const doc = new Y.Doc();
  const a = addAction(doc, { name: "A", inputs: [open("place")] });
  const b = addAction(doc, { name: "B", inputs: [open("place", "number")] });
  expect(interfaceOf(readGraph(mapsOf(doc)))).toEqual({ inputs: [], outputs: [] });
  setEntry(doc, a);
  setEntry(doc, b);
  expect(interfaceOf(readGraph(mapsOf(doc))).inputs[0]?.mixed).toBe(true);
});
