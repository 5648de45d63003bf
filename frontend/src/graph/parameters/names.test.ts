import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../document-keys";
import { addAction, connect } from "../edit";
import { readGraph } from "../read";
import { nameSuggestions, pathFrom, taken } from "./names";

const parameter = (path: string, type = "number") => ({ path, text: `{"pvf_type": "${type}"}` });

test("a new parameter may be called as what its neighbours give, want, or its namesakes have", () => {
  const doc = new Y.Doc();
  const outputs = [parameter("pose/x"), parameter("colour", "string")];
  const look = addAction(doc, { name: "Look", outputs });
  const grip = addAction(doc, { name: "Grip", inputs: [parameter("colour", "string")] });
  addAction(doc, { name: "Grip", inputs: [parameter("force")] });
  connect(doc, look, grip);
  const graph = readGraph(mapsOf(doc));
  const of = (key: string, side: "in" | "out") => {
    const action = graph.actions.find((each) => each.key === key);
    return action && nameSuggestions(graph, action, side).map(({ name, why }) => [name, why]);
  };
  expect(of(grip, "in")).toEqual([
    ["pose.x", "given by Look"],
    ["force", "as in another Grip"],
  ]);
  expect(of(grip, "out")).toEqual([]);
});

test("a name inside another one, or one that is there, is refused", () => {
  const list = ["a", "pose/x", "pose/y"].map((path) => parameter(path));
  expect(taken(list, pathFrom("pose.w"))).toBeNull();
  expect(taken(list, pathFrom("pose"))).toContain("group");
  expect(taken(list, pathFrom("a.b"))).toContain("group");
  expect(taken(list, "a")).toContain("has this name");
});
