/**
 * The keys of the shared document: root maps with flat string keys and nothing nested.
 *
 * This module and `editor/documents/document.py` are the only places that know them. Flat keys let two people
 * fill in different things of one action without replacing each other's container, and let an
 * undone delete bring back what a colleague changed meanwhile.
 */

import type * as Y from "yjs";
import { ENTRY, EXIT, type Key } from "./model";

export { newAid } from "./stop-basics";

export const ROOTS = ["meta", "actions", "relations", "positions", "comments"] as const;
export type Root = (typeof ROOTS)[number];

/** The whole document as plain values. */
export type Maps = { readonly [R in Root]: ReadonlyMap<string, unknown> };

export function rootOf(doc: Y.Doc, root: Root): Y.Map<unknown> {
  return doc.getMap<unknown>(root);
}

/** Returns the present content of the document, by root and key. */
export function mapsOf(doc: Y.Doc): Maps {
  return perRoot((root) => new Map(rootOf(doc, root).entries()));
}

/** Maps from plain JSON; missing roots are empty. */
export function mapsFrom(json: Partial<Record<Root, Readonly<Record<string, unknown>>>>): Maps {
  return perRoot((root) => new Map(Object.entries(json[root] ?? {})));
}

function perRoot(make: (root: Root) => ReadonlyMap<string, unknown>): Maps {
  return {
    meta: make("meta"),
    actions: make("actions"),
    relations: make("relations"),
    positions: make("positions"),
    comments: make("comments"),
  };
}

/** Splits a key of the document at its first `|`: `head` names the owner, `rest` the field, empty without one. */
export function splitKey(key: string): { head: string; rest: string } {
  const bar = key.indexOf("|");
  return bar < 0 ? { head: key, rest: "" } : { head: key.slice(0, bar), rest: key.slice(bar + 1) };
}

export type ParameterSide = "in" | "out";
export type RelationSide = "parents" | "children";

export const actionKey = (aid: Key, field: string): string => `${aid}|${field}`;
export const parameterKey = (aid: Key, side: ParameterSide, path: string): string =>
  `${aid}|${side}/${path}`;
/** The mark by which a start asks for an input. */
export const askKey = (aid: Key, path: string): string => `${aid}|ask/${path}`;
export const extraKey = (aid: Key, field: string): string => `${aid}|x/${field}`;
export const noteKey = (id: string): string => `g/${id}`;
/** The waypoints of a line, by the id of its bundle: `<relation>|<response>`. */
export const waypointsKey = (bundle: string): string => `w/${bundle}`;
/** The bundle whose waypoints stand under a key of `positions`; null for other keys. */
export const bundleOfKey = (key: string): string | null =>
  key.startsWith("w/") ? key.slice(2) : null;

/** The id of a relation, which is also the head of its keys: `<parent>><child>` or `…;n`. */
export function relationId(relation: { parent: Key; child: Key; listing?: number }): string {
  const pair = `${relation.parent}>${relation.child}`;
  return relation.listing ? `${pair};${relation.listing}` : pair;
}

export interface RelationEnds {
  readonly parent: Key;
  readonly child: Key;
  readonly listing: number;
}

const LISTING = /^[1-9][0-9]{0,8}$/;

/** The ends named by a relation id; null when it fits no pattern. */
export function endsOf(id: string): RelationEnds | null {
  const arrow = id.indexOf(">");
  if (arrow < 0) return null;
  const parent = id.slice(0, arrow);
  const semicolon = id.indexOf(";", arrow);
  const child = id.slice(arrow + 1, semicolon < 0 ? undefined : semicolon);
  const count = semicolon < 0 ? "" : id.slice(semicolon + 1);
  if (semicolon >= 0 && !LISTING.test(count)) return null;
  if (parent === ENTRY ? !isAid(child) : !isAid(parent)) return null;
  if (child !== EXIT && !isAid(child)) return null;
  return { parent, child, listing: semicolon < 0 ? 0 : Number(count) };
}

/** One key of a parameter's path, so that `/` can separate them. */
const escapeSegment = (segment: string): string =>
  segment.replaceAll("~", "~0").replaceAll("/", "~1");
const unescapeSegment = (segment: string): string =>
  segment.replaceAll("~1", "/").replaceAll("~0", "~");
/** The keys that lead to a parameter. */
export const segmentsOf = (path: string): string[] => path.split("/").map(unescapeSegment);
/** A parameter's path from the keys that lead to it. */
export const pathOf = (segments: readonly string[]): string =>
  segments.map(escapeSegment).join("/");
/** The flat name that the engine and remaps use: `pose::position::x`. */
export const flatName = (path: string): string => segmentsOf(path).join("::");

const AID = /^[A-Za-z0-9]{12}$/;

export function isAid(text: string): boolean {
  return AID.test(text);
}
