import { expect, test } from "vitest";
import { type DocumentStep, ownerOf, PastWalk } from "./walk";

const [A, B] = ["aaaaaaaaaaaa", "bbbbbbbbbbbb"];
const empty = { meta: {}, actions: {}, relations: {}, positions: {}, comments: {} };

const step = (
  seq: number,
  key: string,
  before: unknown,
  after: unknown,
  root: DocumentStep["root"] = "actions",
): DocumentStep => ({ seq, author: seq % 2 ? "ada" : "mari", root, key, before, after });

const STEPS = [
  step(2, A, null, "Drive"),
  step(3, A, "Drive", "DriveTo"),
  step(3, `${A}|in/speed`, null, '{"pvf_type":"number","pvf_value":1}'),
  step(5, B, null, "Grip"),
  step(7, B, "Grip", null),
];
const here = { ...empty, actions: { [A]: "DriveTo", [B]: "Grip" } };

function walkAt5(): PastWalk {
  const walk = new PastWalk(here, 5);
  walk.add(STEPS.slice(0, 4), 0, 5);
  walk.add(STEPS.slice(4), 5, 8);
  return walk;
}
const names = (walk: PastWalk, seq: number) => walk.go(seq).actions.map(({ name }) => name);

test("it goes there and back, and is as it was", () => {
  const walk = walkAt5();
  const there = Object.fromEntries([5, 7, 2, 1, 3, 4, 8, 5].map((seq) => [seq, names(walk, seq)]));
  expect(there).toEqual({
    1: [],
    2: ["Drive"],
    3: ["DriveTo"],
    4: ["DriveTo"],
    5: ["DriveTo", "Grip"],
    7: ["DriveTo"],
    8: ["DriveTo"],
  });
});

test("what a step leaves keeps its identity", () => {
  const walk = walkAt5();
  const [drive] = walk.go(5).actions;
  expect(walk.go(7).actions[0]).toBe(drive);
});

test("neighbours are the changes that set something", () => {
  const walk = walkAt5();
  const seen = [8, 7, 5, 3, 2].map((seq) => {
    walk.go(seq);
    return [walk.neighbour(-1), walk.neighbour(1)];
  });
  expect(seen).toEqual([
    [5, null],
    [5, null],
    [3, 7],
    [2, 5],
    [1, 3],
  ]);
});

test("steps that do not adjoin are of no use", () => {
  const walk = new PastWalk(here, 5);
  walk.add(STEPS.slice(0, 1), 0, 2);
  expect([walk.reaches(2), walk.reaches(5)]).toEqual([false, true]);
  walk.add(STEPS.slice(1, 4), 2, 6);
  expect([walk.from, walk.upto]).toEqual([2, 6]);
});

test("who set what last, and to what a key belongs", () => {
  expect([...walkAt5().authors(2, 8)]).toEqual([
    [A, "ada"],
    [B, "ada"],
  ]);
  expect(ownerOf("positions", `w/${A}>${B}|run`)).toBe(`${A}>${B}`);
  expect(ownerOf("positions", "g/x")).toBe("g/x");
  expect(ownerOf("meta", "name")).toBeNull();
});
