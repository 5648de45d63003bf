import { expect, test } from "vitest";
import { EMPTY_GRAPH, ENTRY, EXIT, type Graph, type Key } from "../../graph/model";
import { anyAction, anyRelation } from "../../testing/graphs";
import { inPortrait, topDown } from "./portrait";

const PHONE = { width: 390, height: 844 };

function graphOf(count: number, pairs: readonly (readonly [Key, Key])[]): Graph {
  const actions = Array.from({ length: count }, (_, i) => anyAction(`a${i}`));
  const relations = pairs.map(([parent, child]) => anyRelation(parent, child));
  return { ...EMPTY_GRAPH, direction: "right", actions, relations };
}

const chain = graphOf(4, [
  [ENTRY, "a0"],
  ["a0", "a1"],
  ["a1", "a2"],
  ["a2", "a3"],
  ["a3", EXIT],
]);

const fan = graphOf(
  8,
  Array.from({ length: 8 }, (_, i) => [[ENTRY, `a${i}`] as const, [`a${i}`, EXIT] as const]).flat(),
);

test("a phone draws actions after one another top-down, and actions beside one another as they are", () => {
  expect(inPortrait(chain, PHONE)).toEqual({ ...chain, direction: "down" });
  expect(inPortrait(fan, PHONE)).toBe(fan);
});

test("a graph in which somebody has placed a card is drawn as it stands", () => {
  const [first, ...others] = chain.actions;
  if (first === undefined) throw new Error("no action");
  const placed = { ...chain, actions: [{ ...first, position: [0, 0] as const }, ...others] };
  expect(inPortrait(placed, PHONE)).toBe(placed);
});

test("a placed graph is turned without its places, each action the same object as long as it is unchanged", () => {
  const placed: Graph = {
    ...chain,
    actions: chain.actions.map((action, i) => ({ ...action, position: [i * 300, 0] as const })),
    entryPosition: [-200, 0],
  };
  const turned = topDown(placed);
  expect(turned.direction).toBe("down");
  expect(turned.entryPosition).toBeNull();
  expect(turned.actions.map(({ position }) => position)).toEqual([null, null, null, null]);
  expect(topDown({ ...placed, name: "other" }).actions[0]).toBe(turned.actions[0]);
  expect(placed.actions[1]?.position).toEqual([300, 0]);
});
