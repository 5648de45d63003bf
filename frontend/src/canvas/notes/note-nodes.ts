/** Notes and frames as nodes of the canvas. */
import type { Node } from "@xyflow/react";
import { type Note, notesOf } from "../../graph/edit/notes";
import type { Graph, Key } from "../../graph/model";
import { spokenNote } from "../../graph/note-links";
import type { Positions } from "../geometry/arrange";

export type NoteNode = Node<{ note: Note }, "note">;

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
    // A frame lies behind arrows and cards, and only its title takes the pointer.
    zIndex: frame ? -1 : selected.has(note.key) ? 1 : 0,
    ...(frame ? { dragHandle: "[data-title]", style: { pointerEvents: "none" } } : {}),
    connectable: false,
    data: { note },
    ...(size ? { measured: size } : {}),
  };
}

/** Frames go before everything else and notes after it, so that Tab comes to them in that order. */
export function noteNodes(graph: Graph, options: Options) {
  const nodes = notesOf(graph).map((note) => nodeOf(note, options));
  return {
    frames: nodes.filter(({ data }) => data.note.kind === "frame"),
    notes: nodes.filter(({ data }) => data.note.kind === "note"),
  };
}

export function notePlaces(graph: Graph): Positions {
  return new Map(notesOf(graph).map(({ key, at }) => [key, at]));
}
