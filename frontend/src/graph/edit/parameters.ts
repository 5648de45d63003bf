/** Edits of parameters. Values are JSON text, so that what a person types stays as typed. */

import type * as Y from "yjs";
import {
  actionKey,
  askKey,
  extraKey,
  flatName,
  type ParameterSide,
  parameterKey,
  pathOf,
  relationId,
  rootOf,
} from "../document-keys";
import type { JsonText, Key, Parameter } from "../model";
import { remapFor, type Tie } from "../parameters/output-choices";
import { asJsonText } from "../values";
import { asOneEdit, eraseKeys, graphNow, hasAction, writeKey } from "./document-writes";
import { setRemap } from "./relations";

const FIELDS = { in: "input_parameters", out: "output_parameters" } as const;

/**
 * Sets the text of a parameter that exists, from what it is now: a form may show it a moment older.
 * False when it does not exist, or when what comes of it is no JSON.
 */
export function setParameter(
  doc: Y.Doc,
  key: Key,
  side: ParameterSide,
  path: string,
  change: (now: JsonText) => JsonText,
): boolean {
  if (!exists(doc, key, side, path)) return false;
  const now = asJsonText(rootOf(doc, "actions").get(parameterKey(key, side, path)));
  const text = change(now ?? "null");
  if (asJsonText(text) === undefined) return false;
  asOneEdit(doc, () => {
    writeKey(doc, "actions", parameterKey(key, side, path), text);
    eraseKeys(doc, "actions", extraKey(key, FIELDS[side]));
  });
  return true;
}

/** Adds a parameter at the end. False when the path is taken, or when `text` is no JSON. */
export function addParameter(
  doc: Y.Doc,
  key: Key,
  side: ParameterSide,
  path: string,
  text: JsonText,
): boolean {
  if (!hasAction(doc, key) || exists(doc, key, side, path)) return false;
  if (asJsonText(text) === undefined) return false;
  asOneEdit(doc, () => {
    const paths = pathsOf(doc, key, side);
    writeKey(doc, "actions", parameterKey(key, side, path), text);
    writePaths(doc, key, side, [...paths, path]);
  });
  return true;
}

/** Removes a parameter, and what a start asks about it. False when it is gone. */
export function removeParameter(doc: Y.Doc, key: Key, side: ParameterSide, path: string): boolean {
  if (!exists(doc, key, side, path)) return false;
  asOneEdit(doc, () => {
    const paths = pathsOf(doc, key, side).filter((other) => other !== path);
    eraseKeys(doc, "actions", parameterKey(key, side, path));
    if (side === "in") eraseKeys(doc, "actions", askKey(key, path));
    writePaths(doc, key, side, paths);
  });
  return true;
}

/** Gives a parameter another path, in the same place. False when that one is taken. */
export function renameParameter(
  doc: Y.Doc,
  key: Key,
  side: ParameterSide,
  path: string,
  to: string,
): boolean {
  if (!exists(doc, key, side, path) || exists(doc, key, side, to)) return false;
  asOneEdit(doc, () => {
    const paths = pathsOf(doc, key, side).map((other) => (other === path ? to : other));
    const text = rootOf(doc, "actions").get(parameterKey(key, side, path));
    writeKey(doc, "actions", parameterKey(key, side, to), text);
    eraseKeys(doc, "actions", parameterKey(key, side, path));
    const mark = rootOf(doc, "actions").get(askKey(key, path));
    if (side === "in" && mark !== undefined) {
      writeKey(doc, "actions", askKey(key, to), mark);
      eraseKeys(doc, "actions", askKey(key, path));
    }
    writePaths(doc, key, side, paths);
  });
  return true;
}

function exists(doc: Y.Doc, key: Key, side: ParameterSide, path: string): boolean {
  return hasAction(doc, key) && rootOf(doc, "actions").has(parameterKey(key, side, path));
}

function pathsOf(doc: Y.Doc, key: Key, side: ParameterSide): string[] {
  const action = graphNow(doc).actions.find((candidate) => candidate.key === key);
  const parameters = side === "in" ? action?.inputs : action?.outputs;
  return (parameters ?? []).map((parameter) => parameter.path);
}

function writePaths(doc: Y.Doc, key: Key, side: ParameterSide, paths: readonly string[]): void {
  writeKey(doc, "actions", actionKey(key, side), JSON.stringify(paths));
  eraseKeys(doc, "actions", extraKey(key, FIELDS[side]));
}

/** Writes the parameters of a new action. */
export function writeParameters(
  doc: Y.Doc,
  key: Key,
  side: ParameterSide,
  parameters: readonly Parameter[],
): void {
  if (parameters.length === 0) return;
  for (const { path, text } of parameters)
    writeKey(doc, "actions", parameterKey(key, side, path), text);
  writeKey(
    doc,
    "actions",
    actionKey(key, side),
    JSON.stringify(parameters.map(({ path }) => path)),
  );
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

function arrowOf(doc: Y.Doc, id: string) {
  return graphNow(doc).relations.find((relation) => relationId(relation) === id);
}

/** Brings outputs along an arrow to inputs, renamed where the names differ, as one edit. False when it is gone. */
export function takeOutputs(doc: Y.Doc, id: string, ties: readonly Tie[]): boolean {
  const relation = arrowOf(doc, id);
  if (relation === undefined) return false;
  const next = remapFor(relation.remap, ties);
  const kept = new Map(next.map(({ source, target }) => [source, target]));
  return asOneEdit(doc, () => {
    for (const { source, target } of relation.remap) {
      if (kept.get(source) !== target) setRemap(doc, id, source, null);
    }
    const known = new Map(relation.remap.map(({ source, target }) => [source, target]));
    for (const [source, target] of kept) {
      if (known.get(source) !== target) setRemap(doc, id, source, target);
    }
    return true;
  });
}

/** Takes away the renamings that bring outputs to inputs of an action. False when there are none. */
export function leaveOutputs(doc: Y.Doc, key: Key, paths: readonly string[]): boolean {
  const names = new Set(paths.map(flatName));
  const found = graphNow(doc).relations.flatMap((relation) =>
    relation.child !== key
      ? []
      : relation.remap
          .filter(({ target }) => names.has(target))
          .map(({ source }) => ({ id: relationId(relation), source })),
  );
  if (found.length === 0) return false;
  asOneEdit(doc, () => {
    for (const { id, source } of found) setRemap(doc, id, source, null);
  });
  return true;
}
