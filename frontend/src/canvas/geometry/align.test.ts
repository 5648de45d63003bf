import fc from "fast-check";
import { expect, test } from "vitest";
import { align, type Block, distribute } from "./align";

const blocks: readonly Block[] = [
  { key: "a", x: 0, y: 0, width: 100, height: 40 },
  { key: "b", x: 310, y: 90, width: 60, height: 40 },
  { key: "c", x: 180, y: 300, width: 100, height: 80 },
];

test("aligned cards share an edge or a middle, which the outermost card sets", () => {
  expect([...align(blocks, "left").values()].map(([x]) => x)).toEqual([0, 0, 0]);
  expect([...align(blocks, "right").values()].map(([x]) => x)).toEqual([270, 310, 270]);
  expect([...align(blocks, "center").values()].map(([x]) => x)).toEqual([135, 155, 135]);
  expect([...align(blocks, "bottom").values()].map(([, y]) => y)).toEqual([340, 340, 300]);
});

test("distributed cards have equal gaps and keep their order; the outermost stay", () => {
  const block = fc.record({
    x: fc.integer({ min: -900, max: 900 }),
    y: fc.integer({ min: -900, max: 900 }),
    width: fc.constant(100),
    height: fc.integer({ min: 20, max: 200 }),
  });
  fc.assert(
    fc.property(fc.array(block, { minLength: 3, maxLength: 9 }), (list) => {
      const some = list.map((each, i) => ({ ...each, key: String(i) }));
      const places = distribute(some, "x");
      const xs = [...places.values()].map(([x]) => x);
      expect(Math.min(...xs)).toBe(Math.min(...some.map(({ x }) => x)));
      const gaps = xs.slice(1).map((x, i) => x - (xs[i] ?? 0) - 100);
      expect(Math.max(...gaps) - Math.min(...gaps)).toBeLessThanOrEqual(some.length);
    }),
  );
});
