import fc from "fast-check";
import { expect, test } from "vitest";
import { layeredScene, seeded } from "../../testing/scenes";
import { lineNow, pathOf } from "./line-path";
import { routed } from "./routes";
import { simpleLines } from "./simple-lines";

test("a path has round corners, smaller where there is less room", () => {
  expect(
    pathOf([
      [0, 0],
      [40, 0],
      [40, 40],
    ]),
  ).toBe("M0 0L30 0Q40 0 40 10L40 40");
  expect(
    pathOf([
      [0, 0],
      [40, 0],
      [40, 12],
      [80, 12],
    ]),
  ).toBe(
    "M0 0L30 0Q40 0 40 6L40 6Q40 12 50 12L80 12"
      .replace("L30 0Q40 0 40 6", "L34 0Q40 0 40 6")
      .replace("Q40 12 50 12", "Q40 12 46 12"),
  );
});

test("until a line is routed again its pieces stay horizontal or vertical and end at the moved cards", () => {
  fc.assert(
    fc.property(
      fc.integer({ min: 0, max: 1e9 }),
      fc.constantFrom("right", "down"),
      (seed, direction) => {
        const random = seeded(seed);
        const given = layeredScene(12, random, direction === "right" ? "right" : "down");
        const { lines } = routed(given);
        const at = Math.floor(random() * given.cards.length);
        const [dx, dy] = [Math.round(random() * 120 - 60), Math.round(random() * 120 - 60)];
        const cards = given.cards.map((card, i) =>
          i === at ? { ...card, x: card.x + dx, y: card.y + dy } : card,
        );
        for (const simple of simpleLines({ ...given, cards }).values()) {
          const { points } = lineNow(lines.get(simple.id), simple);
          expect([points[0], points.at(-1)]).toEqual([simple.points[0], simple.points.at(-1)]);
          for (const [i, [x, y]] of points.slice(1).entries())
            expect(x === points[i]?.[0] || y === points[i]?.[1]).toBe(true);
        }
      },
    ),
    { numRuns: 30 },
  );
});

test("a line that has not moved is the identical object", () => {
  const given = layeredScene(12, seeded(3), "right");
  const { lines } = routed(given);
  for (const simple of simpleLines(given).values()) {
    const known = lines.get(simple.id);
    if (known?.docked) expect(lineNow(known, simple)).toBe(known);
  }
});
