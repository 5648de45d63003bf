import { expect, test } from "vitest";
import * as Y from "yjs";
import { addAction, connect, setEntry } from "../graph/edit";
import { mapsOf } from "../graph/layout";
import { readGraph } from "../graph/read";
import { inOrder } from "./outline";

test("the outline follows the run, loops once, and forgets nobody", () => {
  const doc = new Y.Doc();
  const last = addAction(doc, { name: "Last" });
  const first = addAction(doc, { name: "First" });
  addAction(doc, { name: "Alone" });
  setEntry(doc, first);
  connect(doc, first, last);
  connect(doc, last, first, "on_false");
  expect(inOrder(readGraph(mapsOf(doc))).map(({ name }) => name)).toEqual([
    "First",
    "Last",
    "Alone",
  ]);
});
