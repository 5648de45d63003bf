import ELK from "elkjs/lib/elk.bundled.js";
import fc from "fast-check";
import { expect, test } from "vitest";
import {
  type Action,
  type Direction,
  EMPTY_GRAPH,
  ENTRY,
  EXIT,
  type Graph,
  type Key,
} from "../../graph/model";
import { examples } from "../../testing/doses";
import { anyAction, anyRelation, graphs } from "../../testing/graphs";
import { arrange, estimatedSizes, positionsOf } from "./arrange";
import { layoutRequest, placesIn } from "./layout-graph";
import { ranksOf } from "./ranks";

const elk = new ELK();

async function laidOut(graph: Graph) {
  const request = layoutRequest(graph, new Map());
  return placesIn(request, await elk.layout(structuredClone(request.root)));
}

function graphOf(
  count: number,
  pairs: readonly (readonly [Key, Key])[],
  direction: Direction = "right",
): Graph {
  const actions = Array.from({ length: count }, (_, i) => anyAction(`a${i}`));
  const relations = pairs.map(([parent, child]) => anyRelation(parent, child));
  return { ...EMPTY_GRAPH, direction, actions, relations };
}

const chain = (count: number, direction: Direction = "right") =>
  graphOf(
    count,
    [
      [ENTRY, "a0"] as const,
      ...Array.from({ length: count - 1 }, (_, i) => [`a${i}`, `a${i + 1}`] as const),
      [`a${count - 1}`, EXIT] as const,
    ],
    direction,
  );

/** How far apart the two nearest cards are; negative when they overlap. */
function nearest(graph: Graph, places: ReadonlyMap<Key, readonly [number, number]>): number {
  const sizes = estimatedSizes(graph);
  const boxes = [...places].map(([key, [x, y]]) => ({ x, y, ...sizes.get(key) }));
  let least = Number.POSITIVE_INFINITY;
  for (const [i, a] of boxes.entries()) {
    for (const b of boxes.slice(i + 1)) {
      const across = Math.max(b.x - a.x - (a.width ?? 0), a.x - b.x - (b.width ?? 0));
      const down = Math.max(b.y - a.y - (a.height ?? 0), a.y - b.y - (b.height ?? 0));
      least = Math.min(least, Math.max(across, down));
    }
  }
  return least;
}

test("cards that are laid out are at least 32 px apart for any arrows", async () => {
  await fc.assert(
    fc.asyncProperty(graphs, async (graph) => {
      const places = await laidOut(graph);
      expect([...places.keys()].sort()).toEqual(
        [ENTRY, EXIT, ...graph.actions.map(({ key }) => key)].sort(),
      );
      expect(nearest(graph, places)).toBeGreaterThanOrEqual(32);
    }),
    { numRuns: examples(60) },
  );
});

test.each(["right", "down"] as const)(
  "the cards of a chain stand in line, direction %s",
  async (direction) => {
    const places = await laidOut(chain(4, direction));
    const across = ["a0", "a1", "a2", "a3"].map(
      (key) => places.get(key)?.[direction === "right" ? 1 : 0],
    );
    expect(new Set(across).size).toBe(1);
  },
);

test("cards of the simple layout do not overlap either", () => {
  fc.assert(
    fc.property(graphs, (graph) => {
      expect(nearest(graph, arrange(graph))).toBeGreaterThanOrEqual(32);
    }),
  );
});

test("an action without a place gets a free one, and moves nothing", () => {
  fc.assert(
    fc.property(graphs, fc.nat(13), (graph, some) => {
      const places = arrange(graph);
      const actions = graph.actions.map((each, i) =>
        i === some % graph.actions.length ? each : { ...each, position: places.get(each.key) },
      ) as Action[];
      const placed: Graph = {
        ...graph,
        actions,
        entryPosition: places.get(ENTRY) ?? null,
        exitPosition: places.get(EXIT) ?? null,
      };
      const now = positionsOf(placed);
      for (const { key, position } of actions) if (position) expect(now.get(key)).toBe(position);
      expect(nearest(placed, now)).toBeGreaterThanOrEqual(32);
    }),
  );
});

/** A graph without loops that is short enough to stand in one piece. */
const short = graphs
  .map((graph) => {
    const at = (key: Key) => (key === ENTRY ? -1 : key === EXIT ? 99 : Number(key.slice(1)));
    const relations = graph.relations.filter(({ parent, child }) => at(parent) < at(child));
    return { ...graph, relations };
  })
  .filter((graph) => Math.max(...ranksOf(graph).values()) < 5);

test("actions are placed in the direction of the graph, the entry first and the exit last", async () => {
  await fc.assert(
    fc.asyncProperty(short, async (graph) => {
      const [places, sizes] = [await laidOut(graph), estimatedSizes(graph)];
      const right = graph.direction === "right";
      const from = (key: Key) => places.get(key)?.[right ? 0 : 1] ?? Number.NaN;
      const to = (key: Key) => from(key) + (sizes.get(key)?.[right ? "width" : "height"] ?? 0);
      const tied = new Set(graph.relations.flatMap(({ parent, child }) => [parent, child]));
      for (const { parent, child } of graph.relations) {
        expect(from(child)).toBeGreaterThanOrEqual(to(parent) + 32);
      }
      for (const key of tied) {
        if (key !== ENTRY) expect(from(key)).toBeGreaterThan(to(ENTRY));
        if (key !== EXIT) expect(to(key)).toBeLessThan(from(EXIT));
      }
    }),
    { numRuns: examples(40) },
  );
});

test("a loop leads back, and the order of its actions stays", async () => {
  const graph = graphOf(3, [
    [ENTRY, "a0"],
    ["a0", "a1"],
    ["a1", "a2"],
    ["a2", "a0"],
    ["a2", EXIT],
  ]);
  const places = await laidOut(graph);
  const xs = [ENTRY, "a0", "a1", "a2", EXIT].map((key) => places.get(key)?.[0] ?? Number.NaN);
  expect(xs).toEqual([...xs].sort((a, b) => a - b));
});

test.each(["right", "down"] as const)("a long chain is wrapped: %s", async (direction) => {
  const graph = chain(25, direction);
  const [places, sizes] = [await laidOut(graph), estimatedSizes(graph)];
  const right = Math.max(...[...places].map(([key, [x]]) => x + (sizes.get(key)?.width ?? 0)));
  const low = Math.max(...[...places].map(([key, [, y]]) => y + (sizes.get(key)?.height ?? 0)));
  expect([right, low].every((length) => length < 1_900)).toBe(true);
});

test("equal graphs are laid out equally, whatever their keys are", async () => {
  await fc.assert(
    fc.asyncProperty(graphs, async (graph) => {
      const renamed = (key: Key) =>
        key === ENTRY || key === EXIT ? key : `z${99 - Number(key.slice(1))}`;
      const twin: Graph = {
        ...graph,
        actions: graph.actions.map((each) => ({ ...each, key: renamed(each.key) })),
        relations: graph.relations
          .map((each) => ({ ...each, parent: renamed(each.parent), child: renamed(each.child) }))
          .reverse(),
      };
      const [one, other] = [await laidOut(graph), await laidOut(twin)];
      for (const [key, at] of one) expect(other.get(renamed(key))).toEqual(at);
    }),
    { numRuns: examples(20) },
  );
});
