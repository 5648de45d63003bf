/** What is expanded gets its room, nothing comes to lie upon something else, and every place can be found again. */
import fc from "fast-check";
import { expect, test } from "vitest";
import { axisOf } from "./room";

const stretches = fc.array(
  fc
    .record({
      from: fc.integer({ min: -3000, max: 3000 }),
      long: fc.integer({ min: 1, max: 400 }),
      by: fc.integer({ min: 0, max: 3000 }),
    })
    .map(({ from, long, by }) => ({ from, to: from + long, by })),
  { maxLength: 8 },
);
const place = fc.double({ min: -5000, max: 5000, noNaN: true });

test("each stretch has the room it asks for, and no distance shrinks", () => {
  fc.assert(
    fc.property(stretches, place, place, (given, a, b) => {
      const { toView } = axisOf(given);
      for (const { from, to, by } of given)
        expect(toView(to) - toView(from)).toBeGreaterThanOrEqual(to - from + by - 1e-6);
      const [less, more] = a < b ? [a, b] : [b, a];
      expect(toView(more) - toView(less)).toBeGreaterThanOrEqual(more - less - 1e-6);
    }),
  );
});

test("where something is drawn leads back to where it stands", () => {
  fc.assert(
    fc.property(stretches, place, (given, at) => {
      const { toView, toDocument } = axisOf(given);
      expect(toDocument(toView(at))).toBeCloseTo(at, 5);
    }),
  );
});

test("what stands before all stretches stays, and two that stand beside each other share the room", () => {
  const { toView } = axisOf([
    { from: 0, to: 200, by: 300 },
    { from: 0, to: 200, by: 500 },
    { from: 400, to: 600, by: 100 },
  ]);
  expect([-50, 0, 200, 400, 600, 1000].map(toView)).toEqual([-50, 0, 700, 900, 1200, 1600]);
});

test("where nothing is expanded everything stands where it stands", () => {
  fc.assert(
    fc.property(place, (at) => {
      const { toView, toDocument } = axisOf([]);
      expect([toView(at), toDocument(at)]).toEqual([at, at]);
    }),
  );
});
