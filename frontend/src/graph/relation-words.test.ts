import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "./document-keys";
import { addAction, connect, setEntry, setExit, setRequired, setResponse } from "./edit";
import { EXIT } from "./model";
import { readGraph } from "./read";
import { ignoredWords, nameOf, relationWords, startWords } from "./relation-words";

function graphOf(doc: Y.Doc) {
  return readGraph(mapsOf(doc));
}

test("an arrow says each thing that it does, with the outcomes that lead there", () => {
  const doc = new Y.Doc();
  const [a, b] = [addAction(doc, { name: "Scan" }), addAction(doc, { name: "Grip" })];
  const id = connect(doc, a, b) as string;
  const words = () => relationWords(graphOf(doc), graphOf(doc).relations[0] as never);
  expect(words()).toEqual(["Runs when Scan ends true."]);
  setResponse(doc, id, "on_false", "run");
  setResponse(doc, id, "on_stopped", "run");
  setResponse(doc, id, "on_error", "bypass");
  expect(words()).toEqual([
    "Runs when Scan ends true, ends false or is stopped.",
    "Is bypassed when Scan ends with an error: the actions after it start at once.",
  ]);
  const nothing = () => ignoredWords(graphOf(doc), graphOf(doc).relations[0] as never);
  expect(nothing()).toBeNull();
  setResponse(doc, id, "on_false", "ignore");
  expect(nothing()).toBe("Nothing happens when Scan ends false.");
  for (const outcome of ["on_true", "on_false", "on_error", "on_stopped"] as const)
    setResponse(doc, id, outcome, "ignore");
  expect(words()).toEqual(["Does nothing, however Scan ends."]);
});

test("an arrow that one side does not know says what comes of that", () => {
  const doc = new Y.Doc();
  const [a, b] = [addAction(doc, { name: "A" }), addAction(doc, { name: "B" })];
  const id = connect(doc, a, b) as string;
  const words = (only: string) => {
    doc.getMap("relations").set(`${id}|only`, only);
    return startWords(graphOf(doc), b).join(" ");
  };
  expect(words("children")).toContain("the engine breaks down when A ends");
  expect(words("parents")).toContain("it never runs");
  setRequired(doc, id, false); // makes it known to both again
  expect(words("parents")).toContain("the arrow does nothing");
});

test("a join says whom it waits for", () => {
  const doc = new Y.Doc();
  const [a, b, c] = ["A", "B", "C"].map((name) => addAction(doc, { name })) as [
    string,
    string,
    string,
  ];
  const [fromA, fromB] = [connect(doc, a, c) as string, connect(doc, b, c) as string];
  const last = () => startWords(graphOf(doc), c).at(-1);
  expect(last()).toBe("Waits until A and B have ended; the last one decides.");
  setRequired(doc, fromB, false);
  expect(last()).toBe("Waits until A has ended, not for B.");
  setRequired(doc, fromA, false);
  expect(last()).toBe("Does not wait for the others: each arrow acts on its own, every time.");
  setEntry(doc, c);
  setRequired(doc, fromA, true);
  expect(last()).toBe("Waits for A also at the start, so it cannot be the first.");
});

test("an end says when the graph ends", () => {
  const doc = new Y.Doc();
  const a = addAction(doc, { name: "A" });
  expect(startWords(graphOf(doc), EXIT)).toEqual(["Nothing ends this graph: it halts or runs on."]);
  expect(startWords(graphOf(doc), a)).toEqual(["Nothing starts this."]);
  setEntry(doc, a);
  const id = setExit(doc, a) as string;
  setResponse(doc, id, "on_error", "bypass");
  expect(startWords(graphOf(doc), a)).toEqual(["Runs when the graph starts."]);
  expect(startWords(graphOf(doc), EXIT)).toEqual([
    "The graph ends when A ends true.",
    "The graph ends at once when A ends with an error, whatever else it waits for.",
  ]);
});

test("a number stands only where a name is not enough", () => {
  const doc = new Y.Doc();
  const [a, b, c] = ["A", "A", "C"].map((name) => addAction(doc, { name })) as [
    string,
    string,
    string,
  ];
  const graph = graphOf(doc);
  expect([a, b, c, "gone"].map((key) => nameOf(graph, key))).toEqual([
    "A 0",
    "A 1",
    "C",
    "something deleted",
  ]);
});
