import fc from "fast-check";
import { expect, test } from "vitest";
import { viewOf, viewportOnto } from "./use-followed-view";

const size = fc.record({
  width: fc.integer({ min: 200, max: 3000 }),
  height: fc.integer({ min: 200, max: 3000 }),
});
const viewport = fc.record({
  x: fc.integer({ min: -5000, max: 5000 }),
  y: fc.integer({ min: -5000, max: 5000 }),
  zoom: fc.integer({ min: 80, max: 2200 }).map((n) => n / 1000),
});

test("a follower with a frame of the same size sees exactly the same", () => {
  fc.assert(
    fc.property(viewport, size, (theirs, frame) => {
      const mine = viewportOnto(viewOf(theirs, frame), frame);
      expect(mine.zoom).toBeCloseTo(theirs.zoom, 5);
      expect(Math.abs(mine.x - theirs.x)).toBeLessThan(2.3);
      expect(Math.abs(mine.y - theirs.y)).toBeLessThan(2.3);
    }),
  );
});

test("a follower sees all that the other sees, around the middle and never larger, in a frame of any size", () => {
  fc.assert(
    fc.property(viewport, size, size, (theirs, their, my) => {
      const view = viewOf(theirs, their);
      const mine = viewportOnto(view, my);
      expect(mine.zoom).toBeLessThanOrEqual(view.zoom);
      const left = view.x * mine.zoom + mine.x;
      const right = (view.x + their.width / view.zoom) * mine.zoom + mine.x;
      expect(left).toBeGreaterThan(-1);
      expect(right).toBeLessThan(my.width + 1);
      expect((left + right) / 2).toBeCloseTo(my.width / 2, 3);
    }),
  );
});
