import { expect, test } from "vitest";
import {
  boundsOf,
  firstViewport,
  isSameViewport,
  viewportShowing,
  wholeViewport,
} from "./viewport";

const room = { width: 800, height: 640 };
const AIR = 28;
const tall = { x: 100, y: -50, width: 600, height: 2000 };

test("a graph is shown whole if its text is readable", () => {
  const small = { x: 0, y: 0, width: 300, height: 300 };
  const view = firstViewport(small, room, [150, 0], 0.75, "down");
  expect(view).toEqual(wholeViewport(small, room));
  expect(view.zoom).toBe(1);
});

test("a graph opens whole as long as the names of its actions are readable", () => {
  const wide = (width: number) => ({ x: 0, y: 0, width, height: 300 });
  const free = room.width - 2 * AIR;
  expect(firstViewport(wide(free / 0.45), room, [0, 0], 0.9, "right").zoom).toBeCloseTo(0.45);
  expect(firstViewport(wide(free / 0.35), room, [0, 0], 0.9, "right").zoom).toBe(0.9);
});

test("a tall graph is shown from its top, centred and readable", () => {
  const view = firstViewport(tall, room, [400, -40], 0.75, "down");
  expect(view.zoom).toBe(0.75);
  expect(tall.y * view.zoom + view.y).toBe(AIR);
  expect((tall.x + tall.width / 2) * view.zoom + view.x).toBe(400);
});

test("a graph that is too wide is centred on its entry, never beyond its edges", () => {
  const wide = { x: 0, y: 0, width: 4000, height: 200 };
  const inside = firstViewport(wide, room, [2000, 0], 0.75, "down");
  expect(2000 * inside.zoom + inside.x).toBe(400);
  const edge = firstViewport(wide, room, [60, 0], 0.75, "down");
  expect(wide.x * edge.zoom + edge.x).toBe(AIR);
});

test("a graph that runs right is shown from its left, at the height of its entry", () => {
  const large = { x: -100, y: 0, width: 4000, height: 3000 };
  const view = firstViewport(large, room, [-60, 1500], 0.9, "right");
  expect(large.x * view.zoom + view.x).toBe(AIR);
  expect(1500 * view.zoom + view.y).toBeCloseTo((room.height - 44) / 2, 0);
});

test("the whole graph fits beside bars and drawers, however tall it is", () => {
  const view = wholeViewport(tall, room);
  expect((tall.y + tall.height) * view.zoom + view.y).toBeLessThanOrEqual(room.height - 44);
  const covered = { left: 0, top: 40, right: 300, bottom: 60 };
  const beside = wholeViewport(tall, { ...room, covered });
  expect(tall.y * beside.zoom + beside.y).toBeGreaterThanOrEqual(40 + AIR - 1);
  expect((tall.x + tall.width) * beside.zoom + beside.x).toBeLessThanOrEqual(room.width - 300);
});

test("showing a visible box does not move the view", () => {
  const card = { x: 100, y: 100, width: 208, height: 100 };
  expect(viewportShowing(card, room, { x: 0, y: 0, zoom: 1 })).toBeNull();
  const view = viewportShowing({ ...card, y: 1500 }, room, { x: 0, y: 0, zoom: 1 });
  expect(view?.zoom).toBe(1);
  expect(1500 + (view?.y ?? 0)).toBeGreaterThan(0);
  expect(1600 + (view?.y ?? 0)).toBeLessThan(room.height - 44);
});

test("the bounds surround everything, with measured sizes where known", () => {
  const places = new Map([
    ["a", [0, 0]],
    ["b", [300, 400]],
  ] as const);
  expect(boundsOf(places, new Map([["b", { width: 100, height: 50 }]]))).toEqual({
    x: 0,
    y: 0,
    width: 400,
    height: 450,
  });
  expect(boundsOf(new Map(), new Map())).toBeNull();
});

test("two views that look the same are alike", () => {
  expect(isSameViewport({ x: 0, y: 0, zoom: 1 }, { x: 1, y: -1, zoom: 1.001 })).toBe(true);
  expect(isSameViewport({ x: 0, y: 0, zoom: 1 }, { x: 9, y: 0, zoom: 1 })).toBe(false);
});

test("showing the whole graph includes lines beyond all cards", () => {
  const places = new Map([["a", [0, 0] as const]]);
  const points = [
    [-40, 20],
    [900, 300],
  ] as const;
  expect(boundsOf(places, new Map(), points)).toEqual({ x: -40, y: 0, width: 940, height: 300 });
  expect(boundsOf(new Map(), new Map(), points)).toBeNull();
});
