import fc from "fast-check";
import { expect, test } from "vitest";
import { detailAt, unitAt } from "./zoom-detail";

const ORDER = ["sign", "far", "middle", "near"];
const zoom = fc.double({ min: 0.08, max: 2, noNaN: true });

test.each([
  [1, "near"],
  [0.9, "near"],
  [0.89, "middle"],
  [0.5, "middle"],
  [0.49, "far"],
  [0.32, "sign"],
])("at zoom %d it is %s", (at, detail) => {
  expect(detailAt(at, null)).toBe(detail);
});

test("a threshold is shifted when zooming in, and exact when zooming out", () => {
  expect(detailAt(0.89, "near")).toBe("middle");
  expect(detailAt(0.9, "middle")).toBe("near"); // where graphs open
  expect(detailAt(0.51, "far")).toBe("far");
  expect(detailAt(0.53, "far")).toBe("middle");
});

test("zooming in never shows less, and an unchanged zoom changes nothing", () => {
  fc.assert(
    fc.property(
      zoom,
      zoom,
      fc.constantFrom("near", "middle", "far", "sign" as const),
      (a, b, was) => {
        const [less, more] = [Math.min(a, b), Math.max(a, b)].map((at) => detailAt(at, was));
        expect(ORDER.indexOf(less ?? "")).toBeLessThanOrEqual(ORDER.indexOf(more ?? ""));
        const now = detailAt(a, was);
        expect(detailAt(a, now)).toBe(now);
      },
    ),
  );
});

test("a text of 11 units has 11 px on screen or slightly more", () => {
  fc.assert(
    fc.property(zoom, (at) => {
      expect(11 * unitAt(at) * at).toBeGreaterThanOrEqual(11 * 0.998);
      if (at > 0.3) expect(11 * unitAt(at) * at).toBeLessThan(12.2);
    }),
  );
});
