/** Scenes to route: laid out in columns as graphs are, or thrown together at least 32 px apart. */
import type { Scene, SceneCard, SceneLine } from "../canvas/arrows/scene";
import { gridOffset } from "../canvas/arrows/scene";

export type Random = () => number;

/** Numbers that are the same each time (mulberry32). */
export function seeded(seed: number): Random {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t ^= t + Math.imul(t ^ (t >>> 7), t | 61);
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const whole = (random: Random, below: number) => Math.floor(random() * below);

/** Columns of cards, three of ten lines skip some or lead back, one of twenty goes back. */
export function layeredScene(count: number, random: Random, direction: Scene["direction"]): Scene {
  const rows = Math.max(2, Math.round(Math.sqrt(count * 0.6)));
  const columns = Math.ceil(count / rows);
  const cards = Array.from({ length: count }, (_, i): SceneCard => {
    const [column, row] = [Math.floor(i / rows), i % rows];
    return direction === "right"
      ? { key: `c${i}`, x: column * 300, y: row * 130 + whole(random, 20), width: 160, height: 70 }
      : { key: `c${i}`, x: row * 270 + whole(random, 20), y: column * 200, width: 208, height: 84 };
  });
  const lines: SceneLine[] = [];
  const leaving = new Map<string, number>();
  const arriving = new Map<string, number>();
  const known = new Set<string>();
  for (let tries = 0; tries < 40 * count && lines.length < 1.3 * count; tries += 1) {
    const from = whole(random, count);
    const back = lines.length % 20 === 7;
    const far = random();
    const by = back ? -1 - whole(random, 3) : far < 0.7 ? 1 : far < 0.9 ? 2 : 3;
    const column = Math.floor(from / rows) + by;
    const row = (from % rows) + Math.round((random() + random() - 1) * 3);
    if (column < 0 || column >= columns || row < 0 || row >= rows) continue;
    const [source, target] = [`c${from}`, `c${column * rows + row}`];
    const full = (leaving.get(source) ?? 0) > 2 || (arriving.get(target) ?? 0) > 3;
    if (column * rows + row >= count || full || known.has(`${source}>${target}`)) continue;
    known.add(`${source}>${target}`);
    leaving.set(source, (leaving.get(source) ?? 0) + 1);
    arriving.set(target, (arriving.get(target) ?? 0) + 1);
    const pill = { width: 26 + 13 * whole(random, 3), height: 20 };
    lines.push({ id: `${source}>${target}`, source, target, pill });
  }
  return { direction, offset: gridOffset(cards, direction, null), cards, lines };
}

/** Cards anywhere, at least `gap` px apart, and lines between any of them. */
export function thrownScene(
  count: number,
  random: Random,
  direction: Scene["direction"],
  { gap = 32, lines: perCard = 1.3 } = {},
): Scene {
  const cards: SceneCard[] = [];
  const side = Math.sqrt(count) * 320;
  for (let tries = 0; tries < 60 * count && cards.length < count; tries += 1) {
    const card = {
      key: `c${cards.length}`,
      x: whole(random, side),
      y: whole(random, side * 0.7),
      width: 140 + whole(random, 80),
      height: 40 + whole(random, 90),
    };
    const free = cards.every(
      (other) =>
        card.x >= other.x + other.width + gap ||
        other.x >= card.x + card.width + gap ||
        card.y >= other.y + other.height + gap ||
        other.y >= card.y + card.height + gap,
    );
    if (free) cards.push(card);
  }
  const lines = Array.from({ length: Math.round(cards.length * perCard) }, (_, i): SceneLine => {
    const [source, target] = [whole(random, cards.length), whole(random, cards.length)];
    const pill = random() < 0.9 ? { width: 26 + whole(random, 60), height: 20 } : null;
    return { id: `l${i}`, source: `c${source}`, target: `c${target}`, pill };
  });
  return { direction, offset: gridOffset(cards, direction, null), cards, lines };
}
