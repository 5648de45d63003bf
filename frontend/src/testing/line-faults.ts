/** Counts the faults of the lines in a scene, for tests and the benchmark. Pure. */

import type { Area, Point, Scene } from "../canvas/arrows/scene";
import type { LineMap } from "../canvas/arrows/simple-lines";

export interface Faults {
  /** Lines that pass behind a card. */
  readonly behind: number;
  /** Pairs of lines with no end in common, or with different places there, that lie on each other. */
  readonly shared: number;
  /** Pills on cards, on other pills, on lines of others. */
  readonly onCards: number;
  readonly onPills: number;
  readonly onLines: number;
  /** Pieces that are neither level nor upright. */
  readonly slanted: number;
}

export interface Looks {
  readonly crossings: number;
  readonly turns: number;
  /** Lines that found no way of their own, pills that found no room. */
  readonly simple: number;
  readonly hidden: number;
}

interface Piece {
  readonly line: string;
  readonly a: Point;
  readonly b: Point;
}

const level = ({ a, b }: Piece) => a[1] === b[1];

function piecesOf(lines: LineMap): Piece[] {
  return [...lines.values()].flatMap(({ id, points }) =>
    points.slice(1).flatMap((b, i) => {
      const a = points[i];
      return a ? [{ line: id, a, b }] : [];
    }),
  );
}

function enters({ a, b }: Piece, { x, y, width, height }: Area): boolean {
  const slack = 0.5;
  return (
    Math.min(a[0], b[0]) < x + width - slack &&
    Math.max(a[0], b[0]) > x + slack &&
    Math.min(a[1], b[1]) < y + height - slack &&
    Math.max(a[1], b[1]) > y + slack
  );
}

const meet = (a: Area, b: Area) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;

/** Returns the length over which two pieces lie on each other. */
function sharedLength(p: Piece, q: Piece): number {
  if (level(p) !== level(q)) return 0;
  const way = level(p) ? 0 : 1;
  const off = level(p) ? p.a[1] - q.a[1] : p.a[0] - q.a[0];
  if (Math.abs(off) > 1) return 0;
  const low = Math.max(Math.min(p.a[way], p.b[way]), Math.min(q.a[way], q.b[way]));
  const high = Math.min(Math.max(p.a[way], p.b[way]), Math.max(q.a[way], q.b[way]));
  return high - low;
}

function cross(p: Piece, q: Piece): boolean {
  if (level(p) === level(q)) return false;
  const [flat, tall] = level(p) ? [p, q] : [q, p];
  const within = (x: number, a: number, b: number) =>
    x > Math.min(a, b) + 0.5 && x < Math.max(a, b) - 0.5;
  return within(tall.a[0], flat.a[0], flat.b[0]) && within(flat.a[1], tall.a[1], tall.b[1]);
}

export function pillsOf(scene: Scene, lines: LineMap): Map<string, Area> {
  return new Map(
    scene.lines.flatMap(({ id, pill: size }): [string, Area][] => {
      const pill = lines.get(id)?.pill;
      if (!pill || !size) return [];
      return [[id, { x: pill[0] - size.width / 2, y: pill[1] - size.height / 2, ...size }]];
    }),
  );
}

export function faultsOf(scene: Scene, lines: LineMap): Faults {
  const pieces = piecesOf(lines);
  const pills = pillsOf(scene, lines);
  const ends = new Map(
    [...lines.values()].map(({ id, points }) => {
      const line = scene.lines.find((each) => each.id === id);
      return [id, [`${line?.source} ${points[0]}`, `${line?.target} ${points.at(-1)}`]] as const;
    }),
  );
  const kin = (a: string, b: string) => {
    const [one, other] = [ends.get(a), ends.get(b)];
    return one?.[0] === other?.[0] || one?.[1] === other?.[1];
  };
  const shared = new Set<string>();
  let slanted = 0;
  for (const [i, p] of pieces.entries()) {
    if (p.a[0] !== p.b[0] && p.a[1] !== p.b[1]) slanted += 1;
    for (const q of pieces.slice(i + 1)) {
      if (p.line !== q.line && !kin(p.line, q.line) && sharedLength(p, q) > 1)
        shared.add(`${p.line} ${q.line}`);
    }
  }
  const behind = new Set(
    pieces.flatMap((piece) => (scene.cards.some((card) => enters(piece, card)) ? piece.line : [])),
  );
  const all = [...pills];
  const count = (of: (id: string, box: Area, i: number) => boolean) =>
    all.filter(([id, box], i) => of(id, box, i)).length;
  return {
    behind: behind.size,
    shared: shared.size,
    onCards: count((_, box) => scene.cards.some((card) => meet(box, card))),
    onPills: count((_, box, i) => all.slice(i + 1).some(([, other]) => meet(box, other))),
    onLines: count((id, box) => pieces.some((p) => p.line !== id && enters(p, box))),
    slanted,
  };
}

export function looksOf(scene: Scene, lines: LineMap): Looks {
  const pieces = piecesOf(lines);
  let crossings = 0;
  for (const [i, p] of pieces.entries())
    for (const q of pieces.slice(i + 1)) if (p.line !== q.line && cross(p, q)) crossings += 1;
  const drawn = [...lines.values()];
  const wanted = scene.lines.filter(({ pill }) => pill !== null).length;
  return {
    crossings,
    turns: drawn.reduce((sum, { points }) => sum + Math.max(0, points.length - 2), 0),
    simple: drawn.filter(({ simple }) => simple).length,
    hidden: wanted - pillsOf(scene, lines).size,
  };
}
