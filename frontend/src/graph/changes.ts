/**
 * Changed keys of the document as changes that a person knows: an action, an arrow, the graph.
 *
 * Pure. Each change keeps the keys it is made of, so that some of them can be taken and others not.
 */

import { isolated } from "../words/isolated";
import { bundleOfKey, endsOf, type Maps, ROOTS, type Root, splitKey } from "./document-keys";
import { fieldWords, SILENT_FIELDS, shortText } from "./field-words";
import { ENTRY, EXIT, type Key, PRECONDITIONS } from "./model";
import { endLabel } from "./spoken-name";
import { isEqual } from "./values";
import { readWaypoints } from "./waypoints";

/** Values by key; `undefined` where there is none. */
export type ValuesByRoot = { readonly [R in Root]: ReadonlyMap<string, unknown> };

export interface ChangedField {
  readonly field: string;
  /** In words; null where there was nothing. */
  readonly before: string | null;
  readonly after: string | null;
  /** The value that stands now; absent where it is one of the two. */
  readonly now?: string | null;
}

export interface GraphChange {
  readonly id: string;
  readonly kind: "added" | "removed" | "changed";
  readonly thing: "graph" | "action" | "arrow" | "drawing" | "comment";
  readonly title: string;
  readonly lines: readonly ChangedField[];
  readonly keys: readonly (readonly [Root, string])[];
}

interface ChangesInput {
  readonly difference: ValuesByRoot;
  readonly before: ValuesByRoot;
  /** The graph with these changes: names are looked up in it. */
  readonly here: Maps;
}

const ORDER = ["graph", "action", "arrow", "drawing", "comment"] as const;
const LONGEST = 120;

/** Returns the changes, compared with the present graph `now`. */
export function changesOf(given: ChangesInput, now: Maps): readonly GraphChange[] {
  const groups = new Map<string, [Root, string][]>();
  for (const root of ROOTS) {
    for (const key of given.difference[root].keys()) {
      const id = groupOf(root, key);
      groups.set(id, [...(groups.get(id) ?? []), [root, key]]);
    }
  }
  const changes = [...groups].map(([id, keys]) => changeOf(id, keys, given, now));
  return changes.sort((a, b) => ORDER.indexOf(a.thing) - ORDER.indexOf(b.thing));
}

/** Returns the part of a difference that has only the keys of these changes. */
export function onlyChanges(
  difference: ValuesByRoot,
  changes: readonly GraphChange[],
): ValuesByRoot {
  const keys = new Set(changes.flatMap((change) => change.keys.map(([r, key]) => `${r}/${key}`)));
  const part = (root: Root) =>
    new Map([...difference[root]].filter(([key]) => keys.has(`${root}/${key}`)));
  return {
    meta: part("meta"),
    actions: part("actions"),
    relations: part("relations"),
    positions: part("positions"),
    comments: part("comments"),
  };
}

function groupOf(root: Root, key: string): string {
  const { head } = splitKey(key);
  if (root === "meta") return "meta";
  const line = root === "positions" ? bundleOfKey(key) : null;
  if (line !== null) return `relations/${splitKey(line).head}`;
  if (root === "positions" && !key.startsWith("g/") && key !== ENTRY && key !== EXIT)
    return `actions/${head}`;
  return `${root}/${root === "comments" ? key : head}`;
}

function changeOf(id: string, keys: [Root, string][], given: ChangesInput, now: Maps): GraphChange {
  const slash = id.indexOf("/");
  const [root, head] = slash < 0 ? [id, ""] : [id.slice(0, slash), id.slice(slash + 1)];
  const thing = thingOf(root);
  const kind = kindOf(thing, head, keys, given);
  const lines = keys.flatMap(([r, key]) => lineOf(r, key, given, now) ?? []);
  return { id, kind, thing, title: titleOf(thing, head, given), lines, keys };
}

function thingOf(root: string): GraphChange["thing"] {
  switch (root) {
    case "meta":
      return "graph";
    case "actions":
      return "action";
    case "relations":
      return "arrow";
    case "comments":
      return "comment";
    default:
      return "drawing";
  }
}

function kindOf(
  thing: GraphChange["thing"],
  head: string,
  keys: readonly (readonly [Root, string])[],
  given: ChangesInput,
): GraphChange["kind"] {
  const marks = marksOf(thing, head, keys);
  if (marks.length === 0) return "changed";
  const was = marks.some(([root, key]) => valueBefore(root, key, given) !== undefined);
  const is = marks.some(([root, key]) => given.here[root].get(key) !== undefined);
  if (was === is) return "changed";
  return is ? "added" : "removed";
}

/** The keys by which a thing exists. */
function marksOf(
  thing: GraphChange["thing"],
  head: string,
  keys: readonly (readonly [Root, string])[],
): readonly (readonly [Root, string])[] {
  switch (thing) {
    case "action":
      return [["actions", head]];
    case "arrow":
      return PRECONDITIONS.map((outcome) => ["relations", `${head}|${outcome}`] as const);
    case "comment":
    case "drawing":
      return keys;
    case "graph":
      return [];
  }
}

function valueBefore(root: Root, key: string, { difference, before, here }: ChangesInput): unknown {
  return difference[root].has(key) ? before[root].get(key) : here[root].get(key);
}

function titleOf(thing: GraphChange["thing"], head: string, given: ChangesInput): string {
  switch (thing) {
    case "graph":
      return "Graph";
    case "action":
      return nameOf(head, given);
    case "arrow": {
      const ends = endsOf(head);
      return ends === null
        ? head
        : `${isolated(nameOf(ends.parent, given))} → ${isolated(nameOf(ends.child, given))}`;
    }
    case "comment":
      return "Comment";
    case "drawing":
      return head === ENTRY || head === EXIT ? nameOf(head, given) : "Note or frame";
  }
}

function nameOf(key: Key, { here, before }: ChangesInput): string {
  const end = endLabel(key);
  if (end !== null) return end;
  const name = here.actions.get(key) ?? before.actions.get(key);
  return typeof name === "string" && name !== "" ? name : "an action";
}

function lineOf(root: Root, key: string, given: ChangesInput, now: Maps): ChangedField | null {
  const rest = root === "meta" ? key : splitKey(key).rest;
  if (bundleOfKey(key) !== null && root === "positions") return bendsLine(key, given, now);
  if (SILENT_FIELDS.has(rest) || (root === "comments" && rest !== "")) return null;
  const [was, is] = [given.before[root].get(key), given.difference[root].get(key)];
  const there = now[root].get(key);
  const line = { field: fieldOf(root, rest), before: words(root, was), after: words(root, is) };
  const other = !isEqual(there, was) && !isEqual(there, is);
  return other ? { ...line, now: words(root, there) } : line;
}

/** Describes a change of bends by their number; their places are seen on the canvas. */
function bendsLine(key: string, given: ChangesInput, now: Maps): ChangedField {
  const said = (value: unknown) => {
    const count = typeof value === "string" ? readWaypoints(value).length : 0;
    return count === 0 ? null : `${count} by hand`;
  };
  const [was, is, there] = [given.before, given.difference, now].map((maps) =>
    maps.positions.get(key),
  );
  const line = { field: "Bends", before: said(was), after: said(is) };
  return isEqual(there, was) || isEqual(there, is) ? line : { ...line, now: said(there) };
}

function fieldOf(root: Root, rest: string): string {
  const field = root === "positions" ? "position" : root === "comments" ? "text" : rest;
  const words = fieldWords(field);
  return isolated(`${words.charAt(0).toUpperCase()}${words.slice(1)}`);
}

/** A value for people. Parameters are JSON text, of which the value itself is shown. */
function words(root: Root, value: unknown): string | null {
  if (value === undefined || value === null) return null;
  if (root === "positions" && Array.isArray(value)) return value.map(Math.round).join(", ");
  if (typeof value === "boolean") return value ? "yes" : "no";
  const text = typeof value === "string" ? parameterWords(value) : String(value);
  return shortText(text, LONGEST);
}

function parameterWords(text: string): string {
  if (!text.startsWith("{")) return text;
  try {
    const { pvf_value: value, text: said } = JSON.parse(text) as Record<string, unknown>;
    if (typeof said === "string") return said;
    if (value === undefined) return text;
    return typeof value === "string" ? value : JSON.stringify(value);
  } catch {
    return text;
  }
}
