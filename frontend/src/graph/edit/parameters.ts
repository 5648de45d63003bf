/** Edits of parameters. Values are JSON text, so that what a person types stays as typed. */

import type * as Y from "yjs";
import { actionKey, extraKey, parameterKey, pathOf, rootOf, type Side } from "../document-keys";
import type { JsonText, Key, Parameter } from "../model";
import { asJsonText } from "../values";
import { erase, graphOf, hasAction, put, together } from "./document-writes";

const FIELDS = { in: "input_parameters", out: "output_parameters" } as const;

/**
 * Sets the text of a parameter that exists, from what it is now: a form may show it a moment older.
 * False when it does not exist, or when what comes of it is no JSON.
 */
export function setParameter(
  doc: Y.Doc,
  key: Key,
  side: Side,
  path: string,
  change: (now: JsonText) => JsonText,
): boolean {
  if (!exists(doc, key, side, path)) return false;
  const now = asJsonText(rootOf(doc, "actions").get(parameterKey(key, side, path)));
  const text = change(now ?? "null");
  if (asJsonText(text) === undefined) return false;
  together(doc, () => {
    put(doc, "actions", parameterKey(key, side, path), text);
    erase(doc, "actions", extraKey(key, FIELDS[side]));
  });
  return true;
}

/** Adds a parameter at the end. False when the path is taken, or when `text` is no JSON. */
export function addParameter(
  doc: Y.Doc,
  key: Key,
  side: Side,
  path: string,
  text: JsonText,
): boolean {
  if (!hasAction(doc, key) || exists(doc, key, side, path)) return false;
  if (asJsonText(text) === undefined) return false;
  together(doc, () => {
    const paths = pathsOf(doc, key, side);
    put(doc, "actions", parameterKey(key, side, path), text);
    writePaths(doc, key, side, [...paths, path]);
  });
  return true;
}

export function removeParameter(doc: Y.Doc, key: Key, side: Side, path: string): boolean {
  if (!exists(doc, key, side, path)) return false;
  together(doc, () => {
    const paths = pathsOf(doc, key, side).filter((other) => other !== path);
    erase(doc, "actions", parameterKey(key, side, path));
    writePaths(doc, key, side, paths);
  });
  return true;
}

/** Gives a parameter another path, in the same place. False when that one is taken. */
export function renameParameter(
  doc: Y.Doc,
  key: Key,
  side: Side,
  path: string,
  to: string,
): boolean {
  if (!exists(doc, key, side, path) || exists(doc, key, side, to)) return false;
  together(doc, () => {
    const paths = pathsOf(doc, key, side).map((other) => (other === path ? to : other));
    const text = rootOf(doc, "actions").get(parameterKey(key, side, path));
    put(doc, "actions", parameterKey(key, side, to), text);
    erase(doc, "actions", parameterKey(key, side, path));
    writePaths(doc, key, side, paths);
  });
  return true;
}

function exists(doc: Y.Doc, key: Key, side: Side, path: string): boolean {
  return hasAction(doc, key) && rootOf(doc, "actions").has(parameterKey(key, side, path));
}

function pathsOf(doc: Y.Doc, key: Key, side: Side): string[] {
  const action = graphOf(doc).actions.find((candidate) => candidate.key === key);
  const parameters = side === "in" ? action?.inputs : action?.outputs;
  return (parameters ?? []).map((parameter) => parameter.path);
}

function writePaths(doc: Y.Doc, key: Key, side: Side, paths: readonly string[]): void {
  put(doc, "actions", actionKey(key, side), JSON.stringify(paths));
  erase(doc, "actions", extraKey(key, FIELDS[side]));
}

/** Writes the parameters of a new action. */
export function writeParameters(
  doc: Y.Doc,
  key: Key,
  side: Side,
  parameters: readonly Parameter[],
): void {
  if (parameters.length === 0) return;
  for (const { path, text } of parameters) put(doc, "actions", parameterKey(key, side, path), text);
  put(doc, "actions", actionKey(key, side), JSON.stringify(parameters.map(({ path }) => path)));
}

/** The parameters of a parsed `input_parameters` or `output_parameters` object. */
export function parametersFrom(value: unknown): Parameter[] {
  const found: Parameter[] = [];
  const walk = (inner: unknown, path: readonly string[]) => {
    const group = typeof inner === "object" && inner !== null && !Array.isArray(inner);
    const members = group && !("pvf_type" in inner) ? Object.entries(inner) : [];
    if (members.length > 0) for (const [name, member] of members) walk(member, [...path, name]);
    else if (path.length > 0) found.push({ path: pathOf(path), text: JSON.stringify(inner) });
  };
  walk(value, []);
  return found;
}
