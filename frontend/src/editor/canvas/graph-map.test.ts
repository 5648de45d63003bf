/** The map shows everything, each in its colour, and what is seen. */
import { expect, test } from "vitest";
import type { PartOnCard } from "../../canvas/editor-store";
import type { CanvasNode } from "../../canvas/elements";
import type { Action } from "../../graph/model";
import { mapFrame, mapMarks, needsMap, seenArea } from "./graph-map";

const card = (x: number, y: number, actor = "") =>
  ({
    id: `${x}-${y}`,
    type: "action",
    position: { x, y },
    measured: { width: 200, height: 100 },
    data: { action: { actor }, progress: null },
  }) as unknown as CanvasNode;

test("cards of one colour are one path, and cards without a size are left out", () => {
  const unknown = { ...card(5000, 5000), measured: {} } as CanvasNode;
  const { paths, area } = mapMarks([card(0, 0), card(300, 50), card(0, 200, "Ada"), unknown]);
  expect(paths.map(([, path]) => path.split("M").length - 1)).toEqual([2, 1]);
  expect(area).toEqual({ x: 0, y: 0, width: 500, height: 300 });
});

test("the map shows the whole graph and the visible part, centred", () => {
  const seen = seenArea({ x: -1000, y: -20, zoom: 2 }, { width: 2000, height: 400 });
  expect(seen).toEqual({ x: 500, y: 10, width: 1000, height: 200 });
  const frame = mapFrame({ x: 0, y: 0, width: 600, height: 220 }, seen);
  expect(frame.x).toBeLessThan(0);
  expect(frame.x + frame.width).toBeGreaterThan(1500);
  expect(frame.x + frame.width / 2).toBeCloseTo(750);
  expect(frame.y + frame.height / 2).toBeCloseTo(110);
  expect(frame.width / frame.height).toBeCloseTo(142 / 102);
});

test("the map of an empty graph shows the visible part", () => {
  const seen = seenArea({ x: -40, y: -30, zoom: 1 }, { width: 132, height: 92 });
  expect(mapFrame(mapMarks([]).area, seen)).toEqual({
    x: 35,
    y: 25,
    width: 142,
    height: 102,
    scale: 1,
  });
});

test("the map is needed if a graph of more than a screen and a half is not all in sight", () => {
  const seen = { x: 0, y: 0, width: 800, height: 600 };
  const at = (x: number, y: number, width: number, height: number) => ({ x, y, width, height });
  expect(needsMap(at(0, 0, 1_210, 100), seen)).toBe(true);
  expect(needsMap(at(700, 0, 100, 910), seen)).toBe(true);
  expect(needsMap(at(-100, 0, 1_200, 900), seen)).toBe(false);
  expect(needsMap(at(5_000, 5_000, 200, 100), seen)).toBe(false);
  expect(needsMap(at(0, 0, 800, 600), seen)).toBe(false);
});

test("the map shows the actions of an expanded graph in the colours of their states", () => {
  const action = { actor: "" } as Action;
  const part = (x: number, expanded: boolean, progress: unknown) =>
    ({ path: "p", x, y: 40, width: 50, height: 20, action, expanded, progress }) as PartOnCard;
  const parts = [part(10, false, null), part(70, false, { tone: "run" }), part(130, true, null)];
  const { paths, area } = mapMarks([card(1000, 0)], () => parts);
  expect(paths).toHaveLength(3);
  expect(paths.find(([color]) => color === "var(--run)")?.[1]).toMatch(/^M1080,40/);
  expect(area).toEqual({ x: 1000, y: 0, width: 200, height: 100 });
});
