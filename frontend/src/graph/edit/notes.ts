/** Notes and frames: what people write and draw round actions. JSON text under `g/<id>`. */

import type * as Y from "yjs";
import { noteKey, rootOf } from "../document-keys";
import type { Graph, JsonText, Position } from "../model";
import { asJsonText } from "../values";
import { addNote, setNote } from ".";
import { asOneEdit } from "./document-writes";

export const NOTE_COLORS = ["grey", "amber", "green", "blue", "violet", "red"] as const;
export type NoteColor = (typeof NOTE_COLORS)[number];

export interface Note {
  /** `g/<id>`, as in selections and places. */
  readonly key: string;
  /** A frame lies behind the actions and takes along what lies in it. */
  readonly kind: "note" | "frame";
  readonly at: Position;
  readonly size: Position;
  /** Plain text; a frame's is its title. */
  readonly text: string;
  readonly color: NoteColor;
}

export type NewNote = Omit<Note, "key">;

const finite = (value: unknown): value is number =>
  typeof value === "number" && Number.isFinite(value) && Math.abs(value) < 1e7;

function pair(value: unknown): Position | null {
  if (!Array.isArray(value) || value.length !== 2) return null;
  const [x, y] = value as unknown[];
  return finite(x) && finite(y) ? [x, y] : null;
}

/** Reads a note from its text; null when it is no note of ours, which then stays as it is. */
export function readNote(key: string, text: JsonText): Note | null {
  let value: unknown;
  try {
    value = JSON.parse(text);
  } catch {
    return null;
  }
  if (typeof value !== "object" || value === null) return null;
  const { kind, at, size, text: words, color } = value as Record<string, unknown>;
  const place = pair(at);
  if (place === null || (kind !== "note" && kind !== "frame")) return null;
  const [width, height] = pair(size) ?? (kind === "note" ? [200, 80] : [320, 220]);
  return {
    key,
    kind,
    at: place,
    size: [Math.max(60, width), Math.max(32, height)],
    text: typeof words === "string" ? words.slice(0, 5_000) : "",
    color: NOTE_COLORS.find((known) => known === color) ?? "grey",
  };
}

let last: { readonly notes: Graph["notes"]; readonly read: readonly Note[] } | null = null;

/** Returns the notes and frames of a graph: the same list while none of them changes. */
export function notesOf(graph: Graph): readonly Note[] {
  if (last !== null && last.notes === graph.notes) return last.read;
  const read = graph.notes.flatMap(([id, text]) => readNote(noteKey(id), text) ?? []);
  last = { notes: graph.notes, read };
  return read;
}

/** Adds a note or frame and returns its key. */
export function writeNote(doc: Y.Doc, note: NewNote): string {
  return noteKey(addNote(doc, textOf(note, {})));
}

/**
 * Changes a note or frame; members that others wrote into it stay. False when it is gone.
 *
 * A note is one text, so it is the document's newest that changes: what a page shows may be older.
 */
export function changeNote(doc: Y.Doc, key: string, change: Partial<NewNote>): boolean {
  const id = key.slice(2);
  const text = asJsonText(rootOf(doc, "positions").get(key));
  const note = text === undefined ? null : readNote(key, text);
  if (text === undefined || note === null) return false;
  return setNote(doc, id, textOf({ ...note, ...change }, JSON.parse(text)));
}

function textOf({ kind, at, size, text, color }: NewNote, others: object): JsonText {
  return JSON.stringify({ ...others, kind, at, size, text, color });
}

/** Moves several notes and frames as one edit. */
export function placeNotes(doc: Y.Doc, graph: Graph, places: ReadonlyMap<string, Position>): void {
  asOneEdit(doc, () => {
    for (const { key, at } of notesOf(graph)) {
      const to = places.get(key);
      if (to && (to[0] !== at[0] || to[1] !== at[1])) changeNote(doc, key, { at: to });
    }
  });
}

interface Sized {
  readonly width: number;
  readonly height: number;
}

/** Returns the keys of all things whose middle lies in a frame, a smaller frame with all that is in it. */
export function inFrame(
  frame: Note,
  places: ReadonlyMap<string, Position>,
  sizes: ReadonlyMap<string, Sized>,
): string[] {
  const [left, top] = frame.at;
  const [width, height] = frame.size;
  return [...places].flatMap(([key, [x, y]]) => {
    if (key === frame.key) return [];
    const size = sizes.get(key) ?? { width: 208, height: 92 };
    if (key.startsWith("g/") && size.width * size.height >= width * height) return [];
    const [mx, my] = [x + size.width / 2, y + size.height / 2];
    return mx > left && mx < left + width && my > top && my < top + height ? [key] : [];
  });
}

/** Returns the new places of what moves, with the things inside of moved frames moved by the same distance. */
export function withContents(
  graph: Graph,
  moved: ReadonlyMap<string, Position>,
  places: ReadonlyMap<string, Position>,
  sizes: ReadonlyMap<string, Sized>,
): Map<string, Position> {
  const all = new Map(moved);
  for (const frame of notesOf(graph)) {
    const to = moved.get(frame.key);
    if (frame.kind !== "frame" || !to) continue;
    for (const key of inFrame(frame, places, sizes)) {
      const at = places.get(key);
      if (!at || all.has(key)) continue;
      all.set(key, [at[0] + to[0] - frame.at[0], at[1] + to[1] - frame.at[1]]);
    }
  }
  return all;
}
