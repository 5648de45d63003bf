import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../../graph/document-keys";
import { addAction } from "../../graph/edit";
import type { Action } from "../../graph/model";
import { readGraph } from "../../graph/read";
import { misfit, passed, sources, targets } from "./remap-choices";

const parameter = (path: string, type: string, more = "") => ({
  path,
  text: `{"pvf_type": "${type}"${more}}`,
});

function two(): [Action, Action] {
  const doc = new Y.Doc();
  addAction(doc, {
    name: "Look",
    outputs: [
      parameter("pose/x", "number"),
      parameter("colour", "string"),
      parameter("n", "number"),
    ],
  });
  addAction(doc, {
    name: "Grip",
    inputs: [
      parameter("at/x", "number"),
      parameter("colour", "string"),
      parameter("n", "string"),
      parameter("fixed", "number", ', "pvf_updatable": false'),
    ],
  });
  return readGraph(mapsOf(doc)).actions as unknown as [Action, Action];
}

test("an input of another type, a locked one and one that is taken are given with the reason", () => {
  const [look, grip] = two();
  const remap = [{ source: "n", target: "at::x" }];
  expect(sources(look, remap).map(({ name, reason }) => [name, reason])).toEqual([
    ["pose::x", null],
    ["colour", null],
    ["n", "already reaches it as at::x"],
  ]);
  expect(targets(grip, remap, "number").map(({ name, reason }) => [name, reason])).toEqual([
    ["at::x", "already gets n"],
    ["colour", "takes string, not number"],
    ["n", "takes string, not number"],
    ["fixed", "is locked"],
  ]);
});

test("a renaming that does nothing, or worse, says what the engine makes of it", () => {
  const [look, grip] = two();
  const says = (source: string, target: string) => misfit(look, grip, { source, target });
  expect(says("pose::x", "at::x")).toBeNull();
  expect(says("pose::x", "colour")).toContain("takes string, not number");
  expect(says("gone", "at::x")).toContain("breaks down");
  expect(says("pose::x", "gone")).toContain("has no parameter gone");
  expect(says("pose::x", "fixed")).toContain("locked");
});

test("an output with the same name and type is carried over by itself", () => {
  const [look, grip] = two();
  expect(passed(look, grip, [])).toEqual(["colour"]);
  expect(passed(look, grip, [{ source: "colour", target: "n" }])).toEqual([]);
});
