import fc from "fast-check";
import { expect, test } from "vitest";
import type { Direction } from "../../graph/model";
import { examples } from "../../testing/doses";
import { faultsOf, looksOf, pillsOf } from "../../testing/line-faults";
import { layeredScene, seeded, thrownScene } from "../../testing/scenes";
import { routed } from "./routes";
import { gridOffset, type Scene, STEP } from "./scene";
import { simpleLines } from "./simple-lines";

const DIRECTIONS: readonly Direction[] = ["right", "down"];
const seed = fc.integer({ min: 0, max: 1e9 });
const NONE = { behind: 0, onCards: 0, onPills: 0, onLines: 0, slanted: 0 };

const card = (key: string, x: number, y: number) => ({ key, x, y, width: 160, height: 72 });
const line = (source: string, target: string, width = 26) => ({
  id: `${source}>${target}`,
  source,
  target,
  pill: { width, height: 20 },
});
const scene = (
  cards: Scene["cards"],
  lines: Scene["lines"],
  direction: Direction = "right",
): Scene => ({
  ...{ direction, offset: gridOffset(cards, direction, null), cards, lines },
});

test.each([
  [200, false],
  [60, true],
])("a pill with %i px of room shows the outcome; only its outcome: %s", (gap, lean) => {
  const handed = { ...line("a", "b"), pill: { width: 68, height: 20, lean: 26 } };
  const rows = [0, 90, -90].flatMap((y) => [card(`l${y}`, 0, y), card(`r${y}`, 160 + gap, y)]);
  const given = scene(rows, [{ ...handed, source: "l0", target: "r0" }]);
  const found = routed(given).lines.get("a>b");
  expect(found?.pill).not.toBeNull();
  expect(found?.lean === true).toBe(lean);
});

test("in a graph that is laid out no line passes a card, lies on another, or meets a pill", () => {
  // In 3,406 such scenes two lines of one shared a piece (35 cards, seed 27, to the right).
  let sharing = 0;
  fc.assert(
    fc.property(
      fc.integer({ min: 2, max: 40 }),
      seed,
      fc.constantFrom(...DIRECTIONS),
      (n, seed, direction) => {
        const given = layeredScene(n, seeded(seed), direction);
        const { lines } = routed(given);
        const { shared, ...others } = faultsOf(given, lines);
        expect(others).toEqual(NONE);
        sharing += shared;
        expect(looksOf(given, lines)).toMatchObject({ simple: 0, hidden: 0 });
      },
    ),
    { numRuns: examples(30) },
  );
  expect(sharing).toBeLessThanOrEqual(1);
});

test("cards anywhere, 32 px apart: no line passes one, no pill lies on a card, pill or line", () => {
  // In 4,000 such scenes two lines found no way, walled in by pills: they stay simple, and may lie
  // behind a card.
  let walledIn = 0;
  fc.assert(
    fc.property(
      fc.integer({ min: 2, max: 18 }),
      seed,
      fc.constantFrom(...DIRECTIONS),
      (n, seed, direction) => {
        const given = thrownScene(n, seeded(seed), direction);
        const { lines } = routed(given);
        expect(lines.size).toBe(given.lines.length);
        const found = new Map([...lines].filter(([, { simple }]) => !simple));
        expect(faultsOf(given, found)).toMatchObject(NONE);
        walledIn += lines.size - found.size;
      },
    ),
    { numRuns: examples(60) },
  );
  expect(walledIn).toBeLessThanOrEqual(2);
});

test("two lines to the exit are apart, wherever the grid lies when the second one is drawn", () => {
  for (let offset = 0; offset < STEP; offset += 1) {
    const exit = { key: "exit", x: 400, y: 112, width: 84, height: 32 };
    const cards = [card("a", 0, 0), card("b", 0, 180), exit];
    const given = { ...scene(cards, [line("a", "exit"), line("b", "exit")]), offset };
    const known = routed({ ...given, lines: given.lines.slice(0, 1) }).ways;
    const { lines } = routed(given, known);
    const ends = [...lines.values()].map(({ points }) => String(points.at(-1)));
    expect([offset, new Set(ends).size]).toEqual([offset, 2]);
  }
});

test("the same scene has the same lines", () => {
  fc.assert(
    fc.property(seed, fc.constantFrom(...DIRECTIONS), (seed, direction) => {
      const given = thrownScene(10, seeded(seed), direction);
      expect(routed(given).lines).toEqual(routed(structuredClone(given)).lines);
    }),
    { numRuns: examples(15) },
  );
});

test("after a move, lines that are routed again are as good, and the others stay", () => {
  fc.assert(
    fc.property(seed, fc.constantFrom(...DIRECTIONS), (seed, direction) => {
      const random = seeded(seed);
      let given = layeredScene(24, random, direction);
      let { lines, ways } = routed(given);
      for (let move = 0; move < 5; move += 1) {
        const at = Math.floor(random() * given.cards.length);
        const [dx, dy] = [random() * 30 - 15, random() * 30 - 15].map(Math.round);
        const cards = given.cards.map((card, i) =>
          i === at ? { ...card, x: card.x + (dx ?? 0), y: card.y + (dy ?? 0) } : card,
        );
        given = { ...given, cards };
        const next = routed(given, ways);
        expect(faultsOf(given, next.lines)).toEqual({ ...NONE, shared: 0 });
        const far = given.lines.filter(({ id }) => next.ways.get(id) === ways.get(id));
        expect(far.length).toBeGreaterThanOrEqual(given.lines.length - next.searched);
        ({ lines, ways } = next);
      }
      expect(lines.size).toBe(given.lines.length);
    }),
    { numRuns: examples(12) },
  );
});

test("no line is searched when nothing has moved", () => {
  const given = layeredScene(30, seeded(4), "right");
  const first = routed(given);
  const again = routed(given, first.ways);
  expect([again.searched, again.lines]).toEqual([0, first.lines]);
});

test("cards in a row are connected by straight lines in their middle", () => {
  for (const direction of DIRECTIONS) {
    const cards = [0, 1, 2].map((i) =>
      direction === "right" ? card(`c${i}`, i * 260, 7) : card(`c${i}`, 7, i * 180),
    );
    const given = scene(cards, [line("c0", "c1"), line("c1", "c2")], direction);
    for (const { points } of routed(given).lines.values()) {
      expect(points.length).toBe(2);
      expect(points[0]?.[direction === "right" ? 1 : 0]).toBe(
        direction === "right" ? 7 + 36 : 7 + 80,
      );
    }
  }
});

test("a loop leaves at one side, leads back in a lane of its own and enters at the other side", () => {
  const cards = [card("a", 0, 0), card("b", 300, 0), card("c", 600, 0)];
  const given = scene(cards, [line("a", "b"), line("b", "c"), line("c", "a")]);
  const { lines } = routed(given);
  const loop = lines.get("c>a")?.points ?? [];
  expect([loop[0]?.[0], loop.at(-1)?.[0]]).toEqual([760, 0]);
  const beyond = loop.filter(([, y]) => y <= -STEP || y >= 72 + STEP);
  expect(beyond.length).toBe(2);
  expect(faultsOf(given, lines)).toEqual({ ...NONE, shared: 0 });
});

test("an action that follows itself has a line around its card", () => {
  const given = scene([card("a", 0, 0)], [line("a", "a")]);
  const { lines } = routed(given);
  expect(lines.get("a>a")?.points.length).toBe(6);
  expect(faultsOf(given, lines)).toEqual({ ...NONE, shared: 0 });
});

test("a pill stands beside the card that its line leaves, even if many lines leave it", () => {
  const cards = [card("a", 0, 200), ...[0, 1, 2, 3, 4].map((i) => card(`t${i}`, 400, i * 110))];
  const given = scene(
    cards,
    cards.slice(1).map(({ key }) => line("a", key, 52)),
  );
  const { lines } = routed(given);
  const pills = [...pillsOf(given, lines).values()];
  expect(pills.length).toBe(5);
  for (const pill of pills) expect(pill.x).toBe(168);
  expect(faultsOf(given, lines)).toEqual({ ...NONE, shared: 0 });
});

test("lines without room join before they enter a card", () => {
  const end = { key: "exit", x: 900, y: 300, width: 84, height: 32 };
  const cards = [0, 1, 2, 3, 4, 5, 6].map((i) => card(`c${i}`, (i % 2) * 300, i * 110));
  const given = scene(
    [...cards, end],
    cards.map(({ key }) => line(key, "exit")),
  );
  const { lines } = routed(given);
  expect(faultsOf(given, lines)).toEqual({ ...NONE, shared: 0 });
  for (const { points } of lines.values()) {
    const [x, y] = points.at(-1) ?? [0, 0];
    expect([x, y > 300 && y < 332]).toEqual([900, true]);
  }
});

test("lines between overlapping or very distant cards are drawn simply", () => {
  const pile = scene([card("a", 0, 0), card("b", 10, 10)], [line("a", "b")]);
  expect(routed(pile).lines.size).toBe(1);
  const apart = scene([card("a", 0, 0), card("b", 9e6, 9e6)], [line("a", "b")]);
  expect(routed(apart).lines.get("a>b")?.simple).toBe(true);
});

test("simple lines have the same ends and pills as routed lines", () => {
  fc.assert(
    fc.property(seed, fc.constantFrom(...DIRECTIONS), (seed, direction) => {
      const given = layeredScene(16, seeded(seed), direction);
      const simple = simpleLines(given);
      for (const [id, { points, pill }] of routed(given).lines) {
        const other = simple.get(id);
        expect([other?.points[0], other?.points.at(-1)]).toEqual([points[0], points.at(-1)]);
        if (other?.docked) expect(other.pill).toEqual(pill);
      }
      expect(faultsOf(given, simple).slanted).toBe(0);
    }),
    { numRuns: examples(20) },
  );
});

test("a line to a missing card is not drawn", () => {
  expect(routed(scene([card("a", 0, 0)], [line("a", "gone")])).lines.size).toBe(0);
  expect(routed(scene([], [])).lines.size).toBe(0);
});
