import { expect, test } from "vitest";
import {
  alongCurve,
  alongLane,
  boxAt,
  type LabelRequest,
  placeLabels,
  sizeOf,
} from "./label-places";

const wish = (id: string, from: number, to: number): LabelRequest => ({
  id,
  width: 120,
  height: 19,
  anchor: "middle",
  points: alongCurve({ x: from, y: 0 }, { x: to, y: 120 }),
});

const covers = (a: ReturnType<typeof boxAt>, b: ReturnType<typeof boxAt>) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

test("a label alone stands in the middle of its way", () => {
  const places = placeLabels([wish("a", 0, 0)], []);
  expect(places.get("a")).toEqual({ x: 0, y: 60 });
});

test("labels of arrows that converge do not cover each other", () => {
  const wishes = [wish("a", -60, 0), wish("b", 0, 0), wish("c", 60, 0)];
  const places = placeLabels(wishes, []);
  const boxes = wishes.map((one) => boxAt(places.get(one.id) ?? { x: 0, y: 0 }, one));
  for (const [i, box] of boxes.entries()) {
    for (const other of boxes.slice(i + 1)) expect(covers(box, other)).toBe(false);
  }
});

test("a label keeps off a card that stands beside its way", () => {
  const card = { x: 30, y: 50, width: 208, height: 40 };
  const one = wish("a", 0, 0);
  const point = placeLabels([one], [card]).get("a") ?? { x: 0, y: 0 };
  expect(covers(boxAt(point, one), card)).toBe(false);
});

test("a label on a lane hangs beside it and has the whole lane to choose from", () => {
  const one: LabelRequest = { ...wish("a", 0, 0), anchor: "left", points: alongLane(300, 0, 400) };
  const point = placeLabels([one], []).get("a");
  expect(point).toEqual({ x: 300, y: 200 });
  expect(point && boxAt(point, one).x).toBe(290);
});

test("more lines are higher, more words wider", () => {
  const one = sizeOf([{ text: "true → run", signs: 1 }]);
  const two = sizeOf([
    { text: "true → run", signs: 1 },
    { text: "error → bypass · optional", signs: 1 },
  ]);
  expect(two.height).toBeGreaterThan(one.height);
  expect(two.width).toBeGreaterThan(one.width);
});
