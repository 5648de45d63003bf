/** What is expanded is a tree of the graphs for which actions stand; none is inside of itself. */
import fc from "fast-check";
import { expect, test } from "vitest";
import type { LevelGraph } from "../canvas/editor-store";
import { fromUmrf } from "../canvas/from-umrf";
import type { Graph } from "../graph/model";
import { type KnownGraphs, levelsBelow, pathsTo } from "./level-graph";
import { layoutOf } from "./level-layout";
import { roomFor } from "./room";

const graphOf = (name: string, actions: readonly string[]): Graph =>
  fromUmrf({
    graph_name: name,
    actions: actions.map((each, i) => ({
      name: each,
      instance_id: i,
      gui_attributes: { position: { x: i * 260, y: (i % 3) * 40 } },
    })),
  });

/** By name, which here is the id, too. */
const knownOf = (graphs: ReadonlyMap<string, Graph | string | null>): KnownGraphs => ({
  idOf: (name) => (graphs.has(name) ? name : undefined),
  graphOf: (id) => graphs.get(id) ?? null,
});

const TOP = { path: "", names: [], above: ["Round"] };
const round = graphOf("Round", ["Drive", "Fetch", "Fetch"]);
const graphs = new Map<string, Graph | string | null>([
  ["Round", round],
  ["Fetch", graphOf("Fetch", ["Grip", "Round"])],
  ["Grip", graphOf("Grip", ["Close", "Fetch"])],
]);
const all = (known: KnownGraphs, depth = 9) =>
  new Set(pathsTo(round, depth, known, { path: "", above: ["Round"] }));

test("every place has its own level, and a graph is not drawn inside itself", () => {
  const known = knownOf(graphs);
  expect([...all(known)].sort()).toEqual([
    "Fetch_1",
    "Fetch_1/Grip_0",
    "Fetch_2",
    "Fetch_2/Grip_0",
  ]);
  const levels = levelsBelow(round, all(known), known, undefined, TOP);
  const grip = levels.get("Fetch_2")?.levels.get("Grip_0");
  expect(grip?.names).toEqual([
    { name: "Fetch", instanceId: 2 },
    { name: "Grip", instanceId: 0 },
  ]);
  expect([...(grip?.levels.keys() ?? [])]).toEqual([]);
});

test("levels load one after the other, and unknown names have none", () => {
  const known = knownOf(graphs);
  expect([...all(known, 1)]).toEqual(["Fetch_1", "Fetch_2"]);
  expect(levelsBelow(round, new Set(["Drive_0", "Gone_7"]), known, undefined, TOP).size).toBe(0);
});

test("a level that is loading or cannot be loaded is small and empty", () => {
  for (const missing of [null, "There is no such graph."]) {
    const known = knownOf(new Map([...graphs, ["Fetch", missing]]));
    const level = levelsBelow(round, all(known), known, undefined, TOP).get(
      "Fetch_1",
    ) as LevelGraph;
    expect([level.graph, layoutOf(level).cards]).toEqual([missing, []]);
  }
});

test("unchanged levels are identical objects, changed ones are not", () => {
  const known = knownOf(graphs);
  const before = levelsBelow(round, all(known), known, undefined, TOP);
  expect(levelsBelow(round, all(known), known, before, TOP)).toBe(before);
  const collapsed = new Set([...all(known)].filter((path) => path !== "Fetch_1/Grip_0"));
  const after = levelsBelow(round, collapsed, known, before, TOP);
  expect(after.get("Fetch_2")).toBe(before.get("Fetch_2"));
  expect(after.get("Fetch_1")).not.toBe(before.get("Fetch_1"));
});

const overlap = (
  a: { x: number; y: number; width: number; height: number },
  b: { x: number; y: number; width: number; height: number },
) => a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

const places = fc.uniqueArray(fc.tuple(fc.nat(5), fc.nat(5)), {
  minLength: 1,
  maxLength: 9,
  selector: ([x, y]) => `${x} ${y}`,
});

test("everything on a level lies within its frame, and nothing overlaps", () => {
  fc.assert(
    fc.property(
      places,
      places,
      fc.nat(8),
      fc.constantFrom("right", "down"),
      (outer, inner, which, direction) => {
        const at = (name: string, cells: readonly (readonly [number, number])[], nested: number) =>
          fromUmrf({
            graph_name: name,
            gui_attributes: { action_assistant: { direction } },
            actions: cells.map(([x, y], i) => ({
              name: i === nested ? "Inner" : "A",
              instance_id: i,
              gui_attributes: { position: { x: x * 230, y: y * 130 } },
            })),
          });
        const known = knownOf(
          new Map([
            ["Outer", at("Outer", outer, which % outer.length)],
            ["Inner", at("Inner", inner, -1)],
          ]),
        );
        const top = graphOf("Top", ["Outer"]);
        const around = { path: "", above: ["Top"] };
        const expanded = new Set(pathsTo(top, 9, known, around));
        const level = levelsBelow(top, expanded, known, undefined, { ...around, names: [] }).get(
          "Outer_0",
        );
        const { cards, size } = layoutOf(level as LevelGraph);
        expect(cards).toHaveLength(outer.length);
        for (const [i, card] of cards.entries()) {
          expect(card.x >= 0 && card.x + card.width <= size.width).toBe(true);
          expect(card.y >= 0 && card.y + card.height <= size.height).toBe(true);
          for (const other of cards.slice(i + 1)) expect(overlap(card, other)).toBe(false);
        }
      },
    ),
  );
});

test("frames grow with their contents, and waypoints stay on their side", () => {
  const note = {
    kind: "frame",
    at: [-40, -40],
    size: [400, 200],
    text: "Hall",
    color: "grey",
    ours: 1,
  };
  const graph: Graph = {
    ...round,
    notes: [["n1", JSON.stringify(note)]],
    relations: [],
  };
  const rest = new Map(graph.actions.map(({ key }, i) => [key, [i * 400, 0] as const]));
  const roomy = roomFor(graph, rest, new Map([["Drive_0", { width: 608, height: 300 }]]));
  const [, text = ""] = roomy?.graph.notes[0] ?? [];
  const drawn = JSON.parse(text);
  expect(drawn).toMatchObject({ at: [-40, -40], text: "Hall", ours: 1 });
  expect(drawn.size[0]).toBe(400 + 400);
  expect(roomFor(graph, rest, new Map())).toBeNull();
});
