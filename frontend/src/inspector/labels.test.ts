import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { readGraph } from "../graph/read";
import { graphLabels, setLabels } from "./labels";

test("labels come and go, and what a file keeps beside them stays as it is spelled", () => {
  const doc = new Y.Doc();
  const read = () => readGraph(mapsOf(doc));
  const meta = doc.getMap<string>("meta");
  setLabels(doc, ["night", " night", "demo", " "]);
  expect(graphLabels(read())).toEqual(["night", "demo"]);
  setLabels(doc, []);
  expect(meta.size).toBe(0);
  meta.set("x/gui_attributes", '{"zoom": 1.50}');
  setLabels(doc, ["a"]);
  expect(meta.get("x/gui_attributes")).toBe('{"zoom": 1.50, "labels": ["a"]}');
});
