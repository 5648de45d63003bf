/**
 * Pieces of a graph that travel: copied, pasted, duplicated, here or in another graph.
 *
 * A clip holds the very keys of the document, so that nothing is lost on the way; pasting gives every
 * piece a new id, free numbers, and only the arrows between the pieces themselves.
 */

import type * as Y from "yjs";
import {
  actionKey,
  bundleOfKey,
  endsOf,
  isAid,
  mapsOf,
  newAid,
  noteKey,
  type RelationSide,
  relationId,
  rootOf,
  splitKey,
  waypointsKey,
} from "../document-keys";
import { ENTRY, EXIT, type Key, type Position } from "../model";
import { asNumber, asPosition } from "../values";
import { readWaypoints, shifted } from "../waypoints";
import { freeNumber } from "./actions";
import { asOneEdit, nextNumber, numberGhosts, numbersOf, writeKey } from "./document-writes";

type ClipValues = Readonly<Record<string, unknown>>;

export interface Clip {
  readonly actions: ClipValues;
  readonly relations: ClipValues;
  readonly positions: ClipValues;
}

/** The place of pasted things: moved by so much, or with their upper left corner at a place. */
export type PastePosition = { readonly by: Position } | { readonly at: Position };

/**
 * Copies the chosen things with the arrows among them. `places` gives the positions of things that have none of
 * their own.
 */
export function clipOf(
  doc: Y.Doc,
  chosen: ReadonlySet<string>,
  places: ReadonlyMap<Key, Position>,
): Clip {
  const maps = mapsOf(doc);
  const within = (key: Key) => isAid(key) && chosen.has(key);
  const pick = (root: ReadonlyMap<string, unknown>, fits: (key: string) => boolean): ClipValues =>
    Object.fromEntries([...root].filter(([key]) => fits(key)));
  const actions = pick(maps.actions, (key) => within(splitKey(key).head));
  const inside = (key: string) => {
    const ends = endsOf(splitKey(key).head);
    return ends !== null && within(ends.parent) && within(ends.child);
  };
  const relations = pick(maps.relations, inside);
  const bends = pick(maps.positions, (key) => inside(bundleOfKey(key) ?? ""));
  const keys = Object.keys(actions).filter(isAid);
  const notes = pick(maps.positions, (key) => key.startsWith("g/") && chosen.has(key));
  const stand = keys.flatMap((key) => {
    const at = places.get(key);
    return at ? [[key, [...at]] as const] : [];
  });
  return { actions, relations, positions: { ...notes, ...bends, ...Object.fromEntries(stand) } };
}

export function isEmpty(clip: Clip): boolean {
  return Object.keys(clip.actions).length === 0 && Object.keys(clip.positions).length === 0;
}

/**
 * Adds the pieces as one edit and returns the keys of the new things. Arrows from the entry and to the exit are
 * added only to a graph without actions.
 */
export function paste(doc: Y.Doc, clip: Clip, landing: PastePosition): string[] {
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    const empty = numbersOf(doc).length === 0;
    const names = new Map<Key, Key>();
    for (const [key, value] of Object.entries(clip.actions)) {
      if (isAid(key) && typeof value === "string" && clip.actions[`${key}|missing`] !== true) {
        names.set(key, newAid());
      }
    }
    pasteActions(doc, clip, names);
    if (empty) for (const end of [ENTRY, EXIT]) names.set(end, end);
    pasteRelations(doc, clip, names);
    names.delete(ENTRY);
    names.delete(EXIT);
    return [...names.values(), ...pastePositions(doc, clip, names, landing)];
  });
}

function pasteActions(doc: Y.Doc, clip: Clip, names: ReadonlyMap<Key, Key>): void {
  const order = (key: Key) => asNumber(clip.actions[actionKey(key, "order")]) ?? 0;
  let next = nextNumber(doc, "actions", "order", () => true);
  const known = [...numbersOf(doc)];
  for (const [old, key] of [...names].sort(([a], [b]) => order(a) - order(b))) {
    const name = String(clip.actions[old]);
    const wanted = asNumber(clip.actions[actionKey(old, "instance_id")]) ?? 0;
    const taken = known.some((other) => other.name === name && other.instanceId === wanted);
    const instanceId = taken ? freeNumber(known, name) : wanted;
    writeKey(doc, "actions", key, name);
    writeKey(doc, "actions", actionKey(key, "order"), next);
    if (instanceId !== 0) writeKey(doc, "actions", actionKey(key, "instance_id"), instanceId);
    next += 1;
    known.push({ ...BLANK, key, name, instanceId });
  }
  for (const [field, value] of Object.entries(clip.actions)) {
    const { head, rest } = splitKey(field);
    const key = names.get(head);
    if (key && rest !== "" && !OWN.has(rest)) writeKey(doc, "actions", actionKey(key, rest), value);
  }
}

const OWN = new Set(["order", "instance_id", "missing", "twin"]);
const BLANK = {
  type: "sync",
  actor: "",
  description: "",
  inputs: [],
  outputs: [],
  position: null,
  missing: false,
  twin: false,
  extra: [],
} as const;

/** Fields with imported numbers that did not fit. Copies have other numbers, so these fields are left out. */
const NUMBERS = new Set<string>(
  (["parents", "children"] satisfies RelationSide[]).map((side) => `x/${side}/instance_id`),
);

function pasteRelations(doc: Y.Doc, clip: Clip, names: ReadonlyMap<Key, Key>): void {
  for (const [field, value] of Object.entries(clip.relations)) {
    const { head, rest } = splitKey(field);
    const id = copyOf(head, names);
    if (id !== null && !NUMBERS.has(rest)) writeKey(doc, "relations", `${id}|${rest}`, value);
  }
}

/** The id that a relation has between the copies; null when one of them is not there. */
function copyOf(relation: string, names: ReadonlyMap<Key, Key>): string | null {
  const ends = endsOf(relation);
  const parent = ends && names.get(ends.parent);
  const child = ends && names.get(ends.child);
  return parent && child ? relationId({ parent, child, listing: ends.listing }) : null;
}

function pastePositions(
  doc: Y.Doc,
  clip: Clip,
  names: ReadonlyMap<Key, Key>,
  landing: PastePosition,
): string[] {
  const [dx, dy] = shiftOf(clip, landing);
  const positions = rootOf(doc, "positions");
  const notes: string[] = [];
  for (const [old, value] of Object.entries(clip.positions)) {
    const key = names.get(old);
    const at = asPosition(value);
    if (key && at) positions.set(key, [at[0] + dx, at[1] + dy]);
    pasteBends(doc, [old, value], names, [dx, dy]);
    const note = old.startsWith("g/") ? noteAt(value) : null;
    if (note === null) continue;
    const id = noteKey(newAid());
    const moved = { ...note.fields, at: [note.at[0] + dx, note.at[1] + dy] };
    writeKey(doc, "positions", id, JSON.stringify(moved));
    notes.push(id);
  }
  return notes;
}

function pasteBends(
  doc: Y.Doc,
  [key, text]: readonly [string, unknown],
  names: ReadonlyMap<Key, Key>,
  by: Position,
): void {
  const { head, rest } = splitKey(bundleOfKey(key) ?? "");
  const id = copyOf(head, names);
  const places = typeof text === "string" ? readWaypoints(text) : [];
  if (id === null || places.length === 0) return;
  writeKey(doc, "positions", waypointsKey(`${id}|${rest}`), JSON.stringify(shifted(places, by)));
}

function shiftOf(clip: Clip, landing: PastePosition): Position {
  if ("by" in landing) return landing.by;
  const places = Object.values(clip.positions).flatMap((value) => {
    const at = asPosition(value) ?? noteAt(value)?.at;
    return at ? [at] : [];
  });
  if (places.length === 0) return [0, 0];
  const left = Math.min(...places.map(([x]) => x));
  const top = Math.min(...places.map(([, y]) => y));
  return [Math.round(landing.at[0] - left), Math.round(landing.at[1] - top)];
}

function noteAt(value: unknown): { at: Position; fields: Record<string, unknown> } | null {
  if (typeof value !== "string") return null;
  try {
    const fields: unknown = JSON.parse(value);
    if (typeof fields !== "object" || fields === null) return null;
    const at = asPosition((fields as Record<string, unknown>).at);
    return at ? { at, fields: fields as Record<string, unknown> } : null;
  } catch {
    return null;
  }
}

/** Returns the first free name for a copy: "valves v11", "valves v11 2" … */
export function copyNameOf(graph: string, version: string, taken: readonly string[]): string {
  const stem = `${graph || "untitled"} ${version}`.trim();
  for (let n = 1; ; n += 1) {
    const next = n === 1 ? stem : `${stem} ${n}`;
    if (!taken.includes(next)) return next;
  }
}
