import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../../graph/document-keys";
import { addAction, connect, setEntry, setExit } from "../../graph/edit";
import { EXIT } from "../../graph/model";
import { readGraph } from "../../graph/read";
import { actionAt, lineOf, rangeOf, rangeOfArrow } from "./json-positions";

const graph = {
  graph_name: "g",
  graph_entry: [{ name: "B", instance_id: 1 }],
  actions: [
    { name: "A", instance_id: 0, type: "sync", children: [{ name: "B", instance_id: 1 }] },
    { name: "B", instance_id: 1, type: "sync", parents: [] },
  ],
};
const lines = JSON.stringify(graph, null, 2).split("\n");

test("an action is found by name and number, not where others mention it", () => {
  const range = rangeOf(lines, { name: "B", instanceId: 1 });
  const text = lines.slice(range?.[0], (range?.[1] ?? 0) + 1).join("\n");
  expect(JSON.parse(text)).toEqual(graph.actions[1]);
  expect(rangeOf(lines, { name: "B", instanceId: 2 })).toBeNull();
});

test("a line belongs to the action in whose braces it stands", () => {
  const doc = new Y.Doc();
  addAction(doc, { name: "A" });
  const drawn = readGraph(mapsOf(doc));
  const range = rangeOf(lines, { name: "A", instanceId: 0 });
  expect(actionAt(drawn, lines, range?.[0] ?? -1)?.name).toBe("A");
  expect(actionAt(drawn, lines, (range?.[1] ?? 0) + 1)).toBeNull();
  expect(actionAt(drawn, lines, 0)).toBeNull();
});

test("an arrow stands where the action that it comes from names its end", () => {
  const doc = new Y.Doc();
  const [a, b, c] = ["A", "B", "C"].map((name) => addAction(doc, { name })) as [
    string,
    string,
    string,
  ];
  setEntry(doc, a);
  connect(doc, a, c);
  connect(doc, a, b);
  setExit(doc, b);
  const drawn = readGraph(mapsOf(doc));
  const item = (name: string) => ({ name, instance_id: 0 });
  const text = JSON.stringify(
    {
      graph_entry: [item("A")],
      graph_exit: [item("B")],
      actions: [{ ...item("A"), children: [item("C"), item("B")] }, item("B"), item("C")],
    },
    null,
    2,
  );
  for (const relation of drawn.relations) {
    const range = rangeOfArrow(drawn, text, relation);
    const piece = text
      .split("\n")
      .slice(range?.[0], (range?.[1] ?? 0) + 1)
      .join("\n");
    const wanted = relation.child === EXIT ? relation.parent : relation.child;
    const name = drawn.actions.find(({ key }) => key === wanted)?.name;
    expect(JSON.parse(piece.replace(/,$/, ""))).toEqual(item(name ?? ""));
  }
});

/** Every way into a value, with what stands there. */
function* ways(value: unknown, path = ""): Generator<[string, unknown]> {
  yield [path, value];
  if (typeof value !== "object" || value === null) return;
  for (const [key, inner] of Object.entries(value)) {
    yield* ways(inner, `${path}/${key.replaceAll("~", "~0").replaceAll("/", "~1")}`);
  }
}

test("a pointer leads to the line on which its value begins", () => {
  fc.assert(
    fc.property(fc.jsonValue({ maxDepth: 3 }), (value) => {
      const text = JSON.stringify(value, null, 2);
      for (const [path, inner] of ways(value)) {
        const [first] = JSON.stringify(inner, null, 2).split("\n");
        expect(text.split("\n")[lineOf(text, path)]).toContain(first);
      }
    }),
  );
});

test("a pointer that leads nowhere stays where the way ends, also in half a text", () => {
  expect(lineOf('{\n"a": 1\n}', "/b/c")).toBe(0);
  expect(lineOf('{\n"a": [1,\n {', "/a/1/x")).toBe(2);
});
