import { expect, test } from "vitest";
import { middlesOf } from "./bend-handles";
import type { Point } from "./scene";

const line = (
  points: readonly Point[],
  waypoints: readonly Point[] = [],
  pill: Point | null = null,
) => ({
  ...{ id: "l", direction: "right" as const, ends: "", docked: pill !== null, simple: false },
  ...{ points, waypoints, pill },
});

test("each longer piece has a handle in its middle, in the order of the waypoints", () => {
  const points: Point[] = [
    [0, 0],
    [100, 0],
    [100, 200],
    [120, 200],
    [120, 0],
    [300, 0],
  ];
  expect(middlesOf(line(points, [[100, 150]]), 48)).toEqual([
    { index: 0, at: [50, 0] },
    { index: 0, at: [100, 75] },
    { index: 1, at: [100, 175] },
    { index: 1, at: [120, 100] },
    { index: 1, at: [210, 0] },
  ]);
});

test("a piece below the pill or a short piece has no handle, unless the line has no other", () => {
  const straight = line(
    [
      [0, 0],
      [200, 0],
    ],
    [],
    [30, 0],
  );
  expect(middlesOf(straight, 48)).toEqual([{ index: 0, at: [127, 0] }]);
  expect(middlesOf(straight, 200)).toEqual([{ index: 0, at: [127, 0] }]);
  expect(middlesOf({ ...straight, waypoints: [[100, 0]] }, 200)).toEqual([]);
});

test("a waypoint that is left out divides no piece", () => {
  const points: Point[] = [
    [0, 0],
    [200, 0],
  ];
  expect(
    middlesOf(
      line(points, [
        [50, 90],
        [150, 0],
      ]),
      48,
    ),
  ).toEqual([
    { index: 0, at: [75, 0] },
    { index: 2, at: [175, 0] },
  ]);
});
