/** Notes and frames as nodes of the canvas, and their colours. */

import type { Node } from "@xyflow/react";
import { type Note, type NoteColor, notesOf } from "../../graph/edit/notes";
import type { Direction, Graph, Key } from "../../graph/model";
import { spokenNote } from "../../graph/note-links";
import type { ProblemCounts } from "../../graph/problems/problem-kinds";
import type { Tone } from "../../status/progress";
import type { Positions } from "../geometry/ranks";

/** Style tokens of the colours, which fit both themes. */
export const noteColor: Readonly<Record<NoteColor, string>> = {
  grey: "var(--ink3)",
  amber: "var(--false)",
  green: "var(--true)",
  blue: "var(--run)",
  violet: "var(--stopped)",
  red: "var(--error)",
};

export type NoteNode = Node<{ note: Note }, "note">;

/** The number of actions in one state. */
export interface StateCount {
  readonly word: string;
  readonly tone: Tone;
  readonly count: number;
}

/** The contents of a folded frame, as its block shows them. */
export interface FrameBlock {
  readonly actions: number;
  /** The worst state first; empty if nothing has run. */
  readonly states: readonly StateCount[];
  /** The tone of the worst state. */
  readonly tone: Tone | null;
  readonly mark: (ProblemCounts & { readonly reasons: string }) | null;
  readonly direction: Direction;
}

export type FoldedNode = Node<{ note: Note; block: FrameBlock }, "folded">;

interface Options {
  places: Positions;
  selected: ReadonlySet<string>;
  measured: ReadonlyMap<Key, { width?: number; height?: number }>;
  resized?: Note | null;
}

function nodeOf(given: Note, { places, selected, measured, resized }: Options): NoteNode {
  const note = resized?.key === given.key ? resized : given;
  const [x, y] = note === given ? (places.get(note.key) ?? note.at) : note.at;
  const size = measured.get(note.key);
  const frame = note.kind === "frame";
  return {
    id: note.key,
    type: "note",
    ariaLabel: `${frame ? "Frame" : "Note"}, ${note.color}: ${spokenNote(note.text) || "empty"}`,
    position: { x, y },
    width: note.size[0],
    height: note.size[1],
    selected: selected.has(note.key),
    // A frame lies behind cards. Only its title receives the pointer, also where an arrow runs
    // below it.
    zIndex: !frame && selected.has(note.key) ? 1 : 0,
    ...(frame ? { dragHandle: "[data-title]", style: { pointerEvents: "none" } } : {}),
    connectable: false,
    data: { note },
    ...(size ? { measured: size } : {}),
  };
}

/**
 * Return the nodes of frames and notes. Frames come before all other nodes and notes after them,
 * which is the order of the Tab key.
 */
export function noteNodes(graph: Graph, options: Options) {
  const nodes = notesOf(graph).map((note) => nodeOf(note, options));
  return {
    frames: nodes.filter(({ data }) => data.note.kind === "frame"),
    notes: nodes.filter(({ data }) => data.note.kind === "note"),
  };
}

/** Return the places of all notes and frames. */
export function notePlaces(graph: Graph): Positions {
  return new Map(notesOf(graph).map(({ key, at }) => [key, at]));
}
