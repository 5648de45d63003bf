import { expect, test } from "vitest";
import {
  boundsOf,
  isSameViewport,
  MARGIN,
  readableViewport,
  viewportShowing,
  wholeViewport,
} from "./viewport";

const room = { width: 800, height: 640 };
const tall = { x: 100, y: -50, width: 600, height: 2000 };

test("the whole is shown where its text can be read", () => {
  const small = { x: 0, y: 0, width: 300, height: 300 };
  const view = readableViewport(small, room, 150, 0.75);
  expect(view).toEqual(wholeViewport(small, room));
  expect(view.zoom).toBe(1);
});

test("of a tall graph the top is shown, in the middle, and readable", () => {
  const view = readableViewport(tall, room, 400, 0.75);
  expect(view.zoom).toBe(0.75);
  expect(tall.y * view.zoom + view.y).toBe(MARGIN.top);
  expect((tall.x + tall.width / 2) * view.zoom + view.x).toBe(400);
});

test("a graph that is too wide is centred on its entry, never beyond its edges", () => {
  const wide = { x: 0, y: 0, width: 4000, height: 200 };
  const inside = readableViewport(wide, room, 2000, 0.75);
  expect(2000 * inside.zoom + inside.x).toBe(400);
  const edge = readableViewport(wide, room, 60, 0.75);
  expect(wide.x * edge.zoom + edge.x).toBe(MARGIN.side);
});

test("the whole fits, however tall it is", () => {
  const view = wholeViewport(tall, room);
  expect((tall.y + tall.height) * view.zoom + view.y).toBeLessThanOrEqual(
    room.height - MARGIN.bottom + 1,
  );
});

test("what is in view already moves nothing", () => {
  const card = { x: 100, y: 100, width: 208, height: 100 };
  expect(viewportShowing(card, room, { x: 0, y: 0, zoom: 1 })).toBeNull();
  const view = viewportShowing({ ...card, y: 1500 }, room, { x: 0, y: 0, zoom: 1 });
  expect(view?.zoom).toBe(1);
  expect(1500 + (view?.y ?? 0)).toBeGreaterThan(0);
  expect(1600 + (view?.y ?? 0)).toBeLessThan(room.height - MARGIN.bottom);
});

test("the box is round everything, with sizes where they are known", () => {
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
