import fc from "fast-check";
import { expect, test } from "vitest";
import type { Direction } from "../../graph/model";
import { examples } from "../../testing/doses";
import { faultsOf } from "../../testing/line-faults";
import { layeredScene, type Random, seeded, thrownScene } from "../../testing/scenes";
import { routed } from "./routes";
import { gridOffset, type Point, type Scene } from "./scene";
import { simpleLines } from "./simple-lines";

const seed = fc.integer({ min: 0, max: 1e9 });
const direction = fc.constantFrom<Direction>("right", "down");
const NONE = { behind: 0, onCards: 0, onPills: 0, onLines: 0, slanted: 0 };

/** Waypoints for some of the lines, on places that are at least 20 px away from all cards. */
function bent(scene: Scene, random: Random): Scene {
  const place = (): Point | null => {
    const at: Point = [random() * 1_200 - 200, random() * 900 - 200];
    const far = scene.cards.every(
      ({ x, y, width, height }) =>
        at[0] < x - 20 || at[0] > x + width + 20 || at[1] < y - 20 || at[1] > y + height + 20,
    );
    return far ? at : null;
  };
  const lines = scene.lines.map((line) => {
    if (random() > 0.4) return line;
    const waypoints = Array.from({ length: 1 + Math.floor(random() * 3) }, place);
    return { ...line, waypoints: waypoints.flatMap((at) => (at ? [at] : [])) };
  });
  return { ...scene, lines };
}

/** How much of a line is passed before each of the places; null where it does not come by. */
function passed(points: readonly Point[], waypoints: readonly Point[]): (number | null)[] {
  let [from, gone] = [0, 0];
  return waypoints.map(([x, y]) => {
    let length = 0;
    for (let i = 1; i < points.length; i += 1) {
      const [[ax, ay], [bx, by]] = [points[i - 1] ?? [0, 0], points[i] ?? [0, 0]];
      const on =
        Math.min(ax, bx) <= x &&
        x <= Math.max(ax, bx) &&
        Math.min(ay, by) <= y &&
        y <= Math.max(ay, by);
      const here = length + Math.abs(x - ax) + Math.abs(y - ay);
      if (on && i >= from && here >= gone) {
        [from, gone] = [i, here];
        return here;
      }
      length += Math.abs(bx - ax) + Math.abs(by - ay);
    }
    return null;
  });
}

test("a bent line passes its waypoints in their order, level or upright, and no card", () => {
  fc.assert(
    fc.property(fc.integer({ min: 2, max: 14 }), seed, direction, (n, seed, direction) => {
      const random = seeded(seed);
      const plain = thrownScene(n, random, direction);
      // Rarely a card stands where the last piece of a line has to be, bent or not.
      fc.pre(faultsOf(plain, routed(plain).lines).behind === 0);
      const given = bent(plain, random);
      const { lines } = routed(given);
      expect(lines.size).toBe(given.lines.length);
      expect(faultsOf(given, lines)).toMatchObject({ behind: 0, slanted: 0, onCards: 0 });
      const blocked = new Set<string>();
      for (const { id, points, waypoints } of lines.values()) {
        // Where a pill stands, none of its own or another line's waypoints can be visited.
        if (passed(points, waypoints).includes(null)) blocked.add(id);
      }
      const pills = [...lines.values()].flatMap(({ pill }) => (pill ? [pill] : []));
      for (const id of blocked) {
        const { waypoints = [] } = lines.get(id) ?? {};
        const near = waypoints.some(([x, y]) =>
          pills.some(([px, py]) => Math.abs(px - x) < 60 && Math.abs(py - y) < 30),
        );
        expect([id, near]).toEqual([id, true]);
      }
    }),
    { numRuns: examples(25) },
  );
});

test("bending some lines adds no fault to the other lines", () => {
  fc.assert(
    fc.property(seed, direction, (seed, direction) => {
      const random = seeded(seed);
      const given = bent(layeredScene(14, random, direction), random);
      expect(faultsOf(given, routed(given).lines)).toMatchObject({ ...NONE, onLines: 0 });
    }),
    { numRuns: examples(12) },
  );
});

test("the same scene gives the same bent lines, and they are kept while nothing moves", () => {
  fc.assert(
    fc.property(seed, direction, (seed, direction) => {
      const random = seeded(seed);
      const given = bent(layeredScene(14, random, direction), random);
      const first = routed(given);
      expect(routed(structuredClone(given)).lines).toEqual(first.lines);
      expect(routed(given, first.ways).lines).toEqual(first.lines);
    }),
    // Of these some lines lie on others, since there is no more room.
    { numRuns: examples(8), examples: [[363461999, "right"] as const] },
  );
});

const card = (key: string, x: number, y: number) => ({ key, x, y, width: 160, height: 72 });
const scene = (cards: Scene["cards"], waypoints: readonly Point[]): Scene => ({
  direction: "right",
  offset: gridOffset(cards, "right", null),
  cards,
  lines: [{ id: "a>b", source: "a", target: "b", pill: { width: 26, height: 20 }, waypoints }],
});
const lineOf = (given: Scene) => routed(given).lines.get("a>b");

test("a waypoint bends a line that would be straight, and its pill stays where it was", () => {
  const cards = [card("a", 0, 0), card("b", 480, 0)];
  const [straight, line] = [lineOf(scene(cards, [])), lineOf(scene(cards, [[324, -84]]))];
  expect(straight?.points.length).toBe(2);
  expect(line?.points.length).toBe(6);
  expect(line?.pill).toEqual(straight?.pill);
  expect(line?.points.some(([, y]) => y === line.waypoints[0]?.[1])).toBe(true);
});

test("a line leads back to a waypoint behind it, and still enters its card from the front", () => {
  const cards = [card("a", 0, 0), card("b", 480, 0)];
  const line = lineOf(scene(cards, [[-96, 144]]));
  expect(line?.simple).toBe(false);
  expect(passed(line?.points ?? [], line?.waypoints ?? [])).not.toContain(null);
  expect(line?.points.at(-1)?.[0]).toBe(480);
});

test("a waypoint below a card is left out until the card is moved", () => {
  const cards = [card("a", 0, 0), card("b", 600, 0)];
  const there = scene([...cards, card("c", 280, 140)], [[360, 176]]);
  const first = routed(there);
  expect(faultsOf(there, first.lines).behind).toBe(0);
  const gone = scene([...cards, card("c", 280, 400)], [[360, 176]]);
  const line = routed(gone, first.ways).lines.get("a>b");
  expect(passed(line?.points ?? [], line?.waypoints ?? [])).not.toContain(null);
});

test("all other lines are routed although one waypoint is very far away", () => {
  const cards = [card("a", 0, 0), card("b", 480, 0)];
  expect(lineOf(scene(cards, [[9e6, 9e6]]))?.simple).toBe(false);
});

test("simple lines pass their waypoints, too", () => {
  fc.assert(
    fc.property(seed, direction, (seed, direction) => {
      const random = seeded(seed);
      const given = bent(thrownScene(8, random, direction), random);
      const lines = simpleLines(given);
      expect(faultsOf(given, lines).slanted).toBe(0);
    }),
    { numRuns: examples(30) },
  );
});
