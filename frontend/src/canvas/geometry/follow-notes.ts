/** Moves notes and frames along when a graph is laid out again. Pure. */
import { inFrame, type Note } from "../../graph/edit/notes";
import type { Direction, Position } from "../../graph/model";
import { type Box, freeSpot } from "./arrange";
import { CARD, type Sizes } from "./ranks";

type Places = ReadonlyMap<string, Position>;

/** Bounds of the space between a frame and its contents, px; within them each frame keeps its own. */
const MOST_AIR = 60;
const LEAST_AIR = 24;

function boxAt(key: string, places: Places, sizes: Sizes): Box | null {
  const at = places.get(key);
  return at ? { x: at[0], y: at[1], ...(sizes.get(key) ?? CARD) } : null;
}

function around(boxes: readonly Box[]): [left: number, top: number, right: number, low: number] {
  return [
    Math.min(...boxes.map(({ x }) => x)),
    Math.min(...boxes.map(({ y }) => y)),
    Math.max(...boxes.map(({ x, width }) => x + width)),
    Math.max(...boxes.map(({ y, height }) => y + height)),
  ];
}

const air = (given: number) => Math.round(Math.max(LEAST_AIR, Math.min(MOST_AIR, given)));

/** Return the place and size of a frame around its former contents. */
function framed(
  frame: Note,
  inside: readonly string[],
  before: Places,
  after: Places,
  sizes: Sizes,
) {
  const boxes = (places: Places) => inside.flatMap((key) => boxAt(key, places, sizes) ?? []);
  const [left, top, right, low] = around(boxes(before));
  const [x, y, x2, y2] = around(boxes(after));
  const at = [x - air(left - frame.at[0]), y - air(top - frame.at[1])] as const;
  const end = [
    x2 + air(frame.at[0] + frame.size[0] - right),
    y2 + air(frame.at[1] + frame.size[1] - low),
  ] as const;
  return { at, size: [end[0] - at[0], end[1] - at[1]] as const };
}

/** Return by how much the card nearest to a note has moved. */
function shiftOf(note: Note, before: Places, after: Places, sizes: Sizes): Position {
  const [mx, my] = [note.at[0] + note.size[0] / 2, note.at[1] + note.size[1] / 2];
  let least = Number.POSITIVE_INFINITY;
  let shift: Position = [0, 0];
  for (const [key, to] of after) {
    const box = boxAt(key, before, sizes);
    if (box === null) continue;
    const far = Math.hypot(box.x + box.width / 2 - mx, box.y + box.height / 2 - my);
    if (far >= least) continue;
    least = far;
    shift = [to[0] - box.x, to[1] - box.y];
  }
  return shift;
}

/**
 * Return the new place and size of each note: frames surround their former contents, and notes move
 * along with the nearest card.
 */
export function notesAfter(
  notes: readonly Note[],
  before: Places,
  after: Places,
  sizes: Sizes,
  direction: Direction,
): Map<string, Pick<Note, "at" | "size">> {
  const taken = [...after.keys()].flatMap((key) => boxAt(key, after, sizes) ?? []);
  const moved = new Map<string, Pick<Note, "at" | "size">>();
  const cards = new Map([...before].filter(([key]) => after.has(key)));
  for (const note of notes) {
    const inside = note.kind === "frame" ? inFrame(note, cards, sizes) : [];
    if (inside.length > 0) {
      moved.set(note.key, framed(note, inside, before, after, sizes));
      continue;
    }
    const [dx, dy] = shiftOf(note, before, after, sizes);
    const [width, height] = note.size;
    const start = [note.at[0] + dx, note.at[1] + dy] as const;
    const at = freeSpot(start, { width, height }, taken, direction);
    taken.push({ x: at[0], y: at[1], width, height });
    moved.set(note.key, { at, size: note.size });
  }
  return moved;
}
