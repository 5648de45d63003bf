/**
 * Fixes of problems as edits of the document: the twin of `umrf/fixes.py`.
 *
 * Each is one transaction of the person's own, does nothing where there is nothing to do, and says
 * by its answer whether it did something.
 */

import type * as Y from "yjs";
import { endsOf } from "../document-keys";
import { memberText, withMember } from "../json-members";
import type { JsonText, Key } from "../model";
import { asJsonText } from "../values";
import { removeActions, setField } from "./actions";
import { asOneEdit, graphNow, numbersOf } from "./document-writes";
import { setParameter } from "./parameters";
import { mirrorRelation, removeRelation, setRequired } from "./relations";
import { setOutputsOptional } from "./waits";

export const FIXES = [
  "mirror-relation",
  "not-required",
  "outputs-optional",
  "remove-relation",
  "renumber",
  "take-example",
  "type-sync",
] as const;
export type Fix = (typeof FIXES)[number];

/** The parts of a problem that a fix needs. */
export interface Fixable {
  readonly where: { readonly aid?: string; readonly relation?: string; readonly path?: string };
  readonly fix?: string | null;
}

/** The words of a fix's button, and whether the fix may be applied with others, unread. */
interface About {
  readonly words: string;
  /** True if the fix loses nothing that somebody has drawn or written. */
  readonly safe: boolean;
}

export const ABOUT: Readonly<Record<Fix, About>> = {
  "mirror-relation": { words: "List the arrow on both sides", safe: true },
  "not-required": { words: "Do not wait for it", safe: true },
  "outputs-optional": { words: "Let the end not wait for its outputs", safe: true },
  "remove-relation": { words: "Remove the arrow", safe: false },
  renumber: { words: "Give it a free number", safe: true },
  // A robot acts on values: somebody shall have read them.
  "take-example": { words: "Take the example as value", safe: false },
  "type-sync": { words: "Make it “sync”", safe: true },
};

const known: ReadonlySet<unknown> = new Set(FIXES);

/** The fix of a problem that this page knows how to do; null where there is none. */
export function fixOf({ fix, where }: Fixable): Fix | null {
  if (!known.has(fix)) return null;
  const name = fix as Fix;
  return placeOf(name, where) === undefined ? null : name;
}

function placeOf(fix: Fix, where: Fixable["where"]): string | undefined {
  switch (fix) {
    case "mirror-relation":
    case "not-required":
    case "remove-relation":
      return where.relation;
    case "outputs-optional":
    case "renumber":
    case "type-sync":
      return where.aid;
    case "take-example":
      return inputOf(where) === null ? undefined : where.aid;
  }
}

/** The path of the input that a place is about. */
function inputOf({ path = "" }: Fixable["where"]): string | null {
  const head = "/input_parameters/";
  const at = path.indexOf(head);
  return at < 0 ? null : path.slice(at + head.length);
}

/** Does the fix of one problem. False when there is none or nothing is left to do. */
export function applyFix(doc: Y.Doc, problem: Fixable): boolean {
  const fix = fixOf(problem);
  const place = fix && placeOf(fix, problem.where);
  if (!fix || !place) return false;
  return asOneEdit(doc, () => {
    switch (fix) {
      case "mirror-relation":
        return mirrorRelation(doc, place);
      case "not-required":
        return setRequired(doc, place, false);
      case "outputs-optional":
        return setOutputsOptional(doc, place);
      case "remove-relation":
        return removeWithGhosts(doc, place);
      case "renumber":
        return renumber(doc, place);
      case "take-example":
        return takeExample(doc, place, inputOf(problem.where) ?? "");
      case "type-sync":
        return typeSync(doc, place);
    }
  });
}

/** Returns the problems whose fixes lose nothing, one for each thing that is fixed: two problems may have one fix. */
export function safeFixes<P extends Fixable>(problems: readonly P[]): P[] {
  const seen = new Set<string>();
  return problems.filter((problem) => {
    const fix = fixOf(problem);
    if (fix === null || !ABOUT[fix].safe) return false;
    const id = `${fix} ${placeOf(fix, problem.where)}`;
    if (seen.has(id)) return false;
    seen.add(id);
    return true;
  });
}

/** Applies all fixes that lose nothing, as one step of undo. Returns how many did something. */
export function applySafeFixes(doc: Y.Doc, problems: readonly Fixable[]): number {
  return asOneEdit(doc, () => safeFixes(problems).filter((one) => applyFix(doc, one)).length);
}

/** Returns the problems whose fix takes an example as the value. */
export function exampleFixes<P extends Fixable>(problems: readonly P[]): P[] {
  return problems.filter((problem) => fixOf(problem) === "take-example");
}

/** Applies all fixes that take an example, as one step of undo. Returns how many did something. */
export function applyExamples(doc: Y.Doc, problems: readonly Fixable[]): number {
  return asOneEdit(doc, () => exampleFixes(problems).filter((one) => applyFix(doc, one)).length);
}

function takeExample(doc: Y.Doc, key: Key, path: string): boolean {
  const action = graphNow(doc).actions.find((candidate) => candidate.key === key);
  const input = action?.inputs.find((candidate) => candidate.path === path);
  const value = input ? exampleOf(input.text) : null;
  if (value === null) return false;
  return setParameter(doc, key, "in", path, (now) => withMember(now, "pvf_value", value));
}

/** A ghost is there only because arrows name it: it goes with its last one. */
function removeWithGhosts(doc: Y.Doc, id: string): boolean {
  const ends = endsOf(id);
  if (ends === null || !removeRelation(doc, id)) return false;
  const { actions, relations } = graphNow(doc);
  const named = new Set(relations.flatMap(({ parent, child }) => [parent, child]));
  const lonely = actions.filter(
    ({ key, missing }) => missing && !named.has(key) && (key === ends.parent || key === ends.child),
  );
  removeActions(
    doc,
    lonely.map(({ key }) => key),
  );
  return true;
}

/** The greatest number that an arrow can refer to: 16 bits in the engine. */
const MOST = 65_535;
const RESERVED: ReadonlySet<string> = new Set(["graph_entry", "graph_exit"]);

function renumber(doc: Y.Doc, key: Key): boolean {
  const actions = numbersOf(doc);
  const action = actions.find((candidate) => candidate.key === key);
  if (action === undefined) return false;
  const taken = new Set(
    actions
      .filter((other) => other !== action && other.name === action.name)
      .map((other) => other.instanceId),
  );
  if (RESERVED.has(action.name)) taken.add(0);
  if (!taken.has(action.instanceId) && action.instanceId <= MOST) return false;
  let free = 0;
  while (taken.has(free)) free += 1;
  return setField(doc, key, "instanceId", free);
}

function typeSync(doc: Y.Doc, key: Key): boolean {
  const action = graphNow(doc).actions.find((candidate) => candidate.key === key);
  return action?.type === "" && setField(doc, key, "type", "sync");
}

/**
 * Returns the `pvf_example` of a parameter without a value, as the value that it would be; null where there is
 * none that fits.
 */
export function exampleOf(parameter: JsonText): JsonText | null {
  if (!parameter.trimStart().startsWith("{")) return null;
  if (memberText(parameter, "pvf_value") !== null) return null;
  const kind: unknown = parsed(memberText(parameter, "pvf_type"));
  let text = memberText(parameter, "pvf_example");
  const spelled: unknown = parsed(text);
  if (typeof spelled === "string" && kind !== "string") text = spelled.trim();
  const value = parsed(text);
  if (text === null || typeof kind !== "string" || !fits(kind, value)) return null;
  const allowed: unknown = parsed(memberText(parameter, "pvf_allowed_values"));
  const isAllowed = (each: unknown) => JSON.stringify(each) === JSON.stringify(value);
  if (Array.isArray(allowed) && allowed.length > 0 && !allowed.some(isAllowed)) return null;
  return text;
}

function parsed(text: string | null): unknown {
  return text === null || asJsonText(text) === undefined ? undefined : JSON.parse(text);
}

/** Returns true if the engine can read this value as one of a native type; it reads none of other types. */
function fits(kind: string, value: unknown): boolean {
  switch (kind) {
    case "string":
      return typeof value === "string";
    case "number":
      return typeof value === "number" && Number.isFinite(value);
    case "bool":
      return typeof value === "boolean";
    case "strings":
    case "numbers":
    case "bools":
      return Array.isArray(value) && value.every((each) => fits(kind.slice(0, -1), each));
    default:
      return false;
  }
}
