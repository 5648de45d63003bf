import { expect, test } from "vitest";
import { pinched } from "./use-pinch";

const under = (view: { x: number; y: number; zoom: number }, x: number, y: number) => [
  (x - view.x) / view.zoom,
  (y - view.y) / view.zoom,
];

test("a pinch keeps the same part of the canvas between the fingers", () => {
  const view = { x: 40, y: -20, zoom: 0.8 };
  const from = { middle: [300, 400], apart: 200 } as const;
  const to = { middle: [350, 380], apart: 300 } as const;
  const next = pinched(view, from, to, [10, 50]);
  expect(next.zoom).toBeCloseTo(1.2);
  const [x, y] = under(view, 290, 350);
  expect(under(next, 340, 330)[0]).toBeCloseTo(x ?? 0);
  expect(under(next, 340, 330)[1]).toBeCloseTo(y ?? 0);
  expect(pinched(view, from, { ...to, apart: 9_000 }, [0, 0]).zoom).toBe(2.2);
});
