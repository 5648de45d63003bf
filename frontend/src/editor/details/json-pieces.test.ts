import fc from "fast-check";
import { expect, test } from "vitest";
import { pieces, rangeOf } from "./json-pieces";

test("no character of the text is lost or added", () => {
  fc.assert(
    fc.property(fc.jsonValue(), (value) => {
      const text = JSON.stringify(value, null, 2);
      const again = pieces(text)
        .map((line) => line.map((piece) => piece.text).join(""))
        .join("\n");
      expect(again).toBe(text);
    }),
  );
});

test("an action is found by name and number, not where others mention it", () => {
  const graph = {
    graph_name: "g",
    graph_entry: [{ name: "B", instance_id: 1 }],
    actions: [
      { name: "A", instance_id: 0, type: "sync", children: [{ name: "B", instance_id: 1 }] },
      { name: "B", instance_id: 1, type: "sync", parents: [] },
    ],
  };
  const text = JSON.stringify(graph, null, 2);
  const range = rangeOf(text, "B", 1);
  const lines = text.split("\n").slice(range?.[0], (range?.[1] ?? 0) + 1);
  expect(JSON.parse(lines.join("\n"))).toEqual(graph.actions[1]);
  expect(rangeOf(text, "B", 2)).toBeNull();
});
