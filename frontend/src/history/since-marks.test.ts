import { expect, test } from "vitest";
import { EMPTY_GRAPH, ENGINE_DEFAULTS, type Graph, type Relation } from "../graph/model";
import { anyAction } from "../testing/graphs";
import { SinceMarker } from "./since-marks";

const speed = (is: number) => [
  { path: "speed", text: JSON.stringify({ pvf_type: "number", pvf_value: is }) },
];
const arrow = (parent: string, child: string, more: Partial<Relation> = {}): Relation => ({
  ...{ parent, child, listing: 0, conditions: ENGINE_DEFAULTS, required: true, remap: [] },
  ...{ only: null, parentOrder: 0, childOrder: 0, parentsExtra: [], childrenExtra: [] },
  waypoints: [],
  ...more,
});
const graph = (more: Partial<Graph>): Graph => ({ ...EMPTY_GRAPH, ...more });
const before = graph({
  actions: [anyAction("a", speed(0.4)), anyAction("b"), anyAction("gone")],
  relations: [arrow("a", "b")],
});

test("what came and what says something else is marked; what was only moved is not", () => {
  const now = graph({
    actions: [anyAction("a", speed(0.9)), { ...anyAction("b"), position: [5, 5] }, anyAction("c")],
    relations: [
      arrow("a", "b", { conditions: { ...ENGINE_DEFAULTS, on_true: "stop" } }),
      arrow("b", "c"),
    ],
  });
  const marks = new SinceMarker(before).marks(now);
  expect([...marks.keys()]).toEqual(["a", "c", "a>b", "b>c"]);
  expect(marks.get("a")).toEqual({
    change: "changed",
    words: "speed 0.4 → 0.9",
    fields: ["in/speed"],
  });
  expect(marks.get("c")?.change).toBe("added");
  expect(marks.get("a>b")?.fields).toEqual(["on_true"]);
});

test("nothing is marked of a graph that is as it was, and made so again", () => {
  const marker = new SinceMarker(before);
  expect(marker.marks(before).size).toBe(0);
  expect(marker.marks(graph({ ...before, actions: [anyAction("a", speed(2))] })).size).toBe(1);
  const again = graph({ ...before, actions: [anyAction("a", speed(0.4)), anyAction("b")] });
  expect(marker.marks(again).size).toBe(0);
});

test("what did not change is not compared again, and keeps its mark", () => {
  const marker = new SinceMarker(before);
  const changed = anyAction("a", speed(0.9));
  const first = marker.marks(graph({ actions: [changed, anyAction("b")] }));
  expect(marker.marks(graph({ actions: [changed, anyAction("b")] }))).toBe(first);
  const next = marker.marks(graph({ actions: [changed, anyAction("b", speed(1))] }));
  expect(next.get("a")).toBe(first.get("a"));
});
