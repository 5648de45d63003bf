import fc from "fast-check";
import { expect, test } from "vitest";
import { pagesOf } from "./graph-print";

test("a picture that fits is one page, and is never enlarged", () => {
  expect(pagesOf(600, 300)).toEqual({
    pages: [{ x: 0, y: 0, width: 600, height: 300 }],
    scale: 1,
    across: true,
  });
  expect(pagesOf(600, 1100)).toMatchObject({ across: false, pages: [{ height: 1100 }] });
  expect(pagesOf(1500, 400).pages).toHaveLength(1);
  expect(pagesOf(500, 4000).pages.length).toBeGreaterThan(1);
});

test("pages cover a picture of any size, and their number is bounded", () => {
  const length = fc.integer({ min: 1, max: 200_000 });
  fc.assert(
    fc.property(
      length,
      length,
      fc.double({ min: 0, max: 1, noNaN: true }),
      (width, height, part) => {
        const { pages, scale, across } = pagesOf(width, height);
        const [x, y] = [width * part, height * part];
        expect(
          pages.some((p) => x >= p.x && x <= p.x + p.width && y >= p.y && y <= p.y + p.height),
        ).toBe(true);
        expect(pages.length).toBeLessThanOrEqual(40);
        for (const page of pages) {
          expect(page.width * scale).toBeLessThan(across ? 1041 : 701);
          expect(page.height * scale).toBeLessThan(across ? 601 : 901);
        }
      },
    ),
  );
});
