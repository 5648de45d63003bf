/** Edits of actions: add, remove, rename, fields. */

import type * as Y from "yjs";
import templates from "../../api/schema/ready-made.json";
import {
  actionKey,
  bundleOfKey,
  endsOf,
  extraKey,
  newAid,
  type Root,
  rootOf,
  splitKey,
} from "../document-keys";
import {
  type Action,
  ENTRY,
  EXIT,
  type Extra,
  type Graph,
  type Key,
  type Parameter,
  type Position,
  PRECONDITIONS,
  type Relation,
} from "../model";
import {
  asOneEdit,
  eraseKeys,
  graphNow,
  hasAction,
  nextNumber,
  numberGhosts,
  numbersOf,
  writeKey,
} from "./document-writes";
import { writeParameters } from "./parameters";
import { draw } from "./relations";
import { keepingWaits } from "./waits";

/** An action to be added, usually one of the library. */
export interface NewAction {
  readonly name: string;
  readonly type?: string;
  readonly actor?: string;
  readonly description?: string;
  readonly inputs?: readonly Parameter[];
  readonly outputs?: readonly Parameter[];
  readonly position?: Position;
  readonly extra?: Extra;
  /** The name of a ready-made action for people. It is not stored. */
  readonly title?: string;
  /** True if the action stands for a whole graph of that name. It is not stored. */
  readonly ofGraph?: true;
}

/** Templates of the ready-made actions, which people answer, or for which the runner waits. */
export const READY_TEMPLATES: readonly NewAction[] = templates;

/** Adds an action under the lowest free number of its name and returns its key. */
export function addAction(doc: Y.Doc, action: NewAction): Key {
  return asOneEdit(doc, () => {
    const key = newAid();
    const instanceId = freeNumber(numbersOf(doc), action.name);
    writeKey(
      doc,
      "actions",
      actionKey(key, "order"),
      nextNumber(doc, "actions", "order", () => true),
    );
    writeKey(doc, "actions", key, action.name);
    if (instanceId) writeKey(doc, "actions", actionKey(key, "instance_id"), instanceId);
    if (action.type && action.type !== "sync")
      writeKey(doc, "actions", actionKey(key, "type"), action.type);
    if (action.actor) writeKey(doc, "actions", actionKey(key, "actor"), action.actor);
    if (action.description)
      writeKey(doc, "actions", actionKey(key, "description"), action.description);
    writeParameters(doc, key, "in", action.inputs ?? []);
    writeParameters(doc, key, "out", action.outputs ?? []);
    for (const [field, text] of action.extra ?? [])
      writeKey(doc, "actions", extraKey(key, field), text);
    if (action.position) rootOf(doc, "positions").set(key, [...action.position]);
    eraseKeys(doc, "meta", "x/actions");
    numberGhosts(doc);
    return key;
  });
}

/** The lowest number that no real action of that name has. */
export function freeNumber(actions: readonly Action[], name: string, except?: Key): number {
  const taken = new Set(
    actions
      .filter((action) => action.name === name && !action.missing && action.key !== except)
      .map((action) => action.instanceId),
  );
  let number = 0;
  while (taken.has(number)) number += 1;
  return number;
}

/**
 * Removes actions with their arrows and places. With `heal`, what ran a removed action now runs
 * what would have followed its success.
 */
export function removeActions(
  doc: Y.Doc,
  keys: Iterable<Key>,
  options: { readonly heal?: boolean } = {},
): void {
  const gone = new Set([...keys].filter((key) => key !== ENTRY && key !== EXIT));
  asOneEdit(doc, () => {
    numberGhosts(doc);
    if (options.heal) keepingWaits(doc, () => healAndRemove(doc, gone));
    else remove(doc, gone);
  });
}

function healAndRemove(doc: Y.Doc, gone: ReadonlySet<Key>): void {
  for (const key of gone) heal(doc, key);
  remove(doc, gone);
}

function remove(doc: Y.Doc, gone: ReadonlySet<Key>): void {
  const isGone = (id: string) => {
    const ends = endsOf(id);
    return ends !== null && (gone.has(ends.parent) || gone.has(ends.child));
  };
  const erase = (root: Root, fits: (key: string) => boolean) =>
    eraseKeys(doc, root, ...[...rootOf(doc, root).keys()].filter(fits));
  erase("actions", (key) => gone.has(splitKey(key).head));
  erase("relations", (key) => isGone(splitKey(key).head));
  erase("positions", (key) => gone.has(key) || isGone(splitKey(bundleOfKey(key) ?? "").head));
}

function heal(doc: Y.Doc, key: Key): void {
  const graph = graphNow(doc);
  const { before, next } = around(graph, key);
  for (const parent of before) {
    for (const child of next) {
      const outcomes = PRECONDITIONS.filter((outcome) => parent.conditions[outcome] === "run");
      for (const outcome of outcomes) draw(doc, parent.parent, child.child, outcome, "run");
    }
  }
}

/** Returns the arrows into an action, and those that follow its success (or, where none does, any outcome). */
function around(graph: Graph, key: Key): { before: Relation[]; next: Relation[] } {
  const others = graph.relations.filter((relation) => relation.parent !== relation.child);
  const runs = others.filter(
    (relation) =>
      relation.parent === key &&
      PRECONDITIONS.some((outcome) => relation.conditions[outcome] === "run"),
  );
  const onSuccess = runs.filter((relation) => relation.conditions.on_true === "run");
  return {
    before: others.filter((relation) => relation.child === key),
    next: (onSuccess.length > 0 ? onSuccess : runs).sort((a, b) => a.parentOrder - b.parentOrder),
  };
}

/** Renames an action; it keeps its number unless another action of the new name has it. False when it is gone. */
export function rename(doc: Y.Doc, key: Key, name: string): boolean {
  if (!hasAction(doc, key)) return false;
  asOneEdit(doc, () => {
    numberGhosts(doc);
    const actions = numbersOf(doc);
    const action = actions.find((candidate) => candidate.key === key);
    if (action === undefined || action.name === name) return;
    const clash = actions.some(
      (other) => !other.missing && other.name === name && other.instanceId === action.instanceId,
    );
    const number = clash ? freeNumber(actions, name, key) : action.instanceId;
    writeKey(doc, "actions", key, name);
    writeNumber(doc, key, number);
    eraseKeys(doc, "actions", extraKey(key, "name"));
    numberGhosts(doc);
  });
  return true;
}

function writeNumber(doc: Y.Doc, key: Key, number: number): void {
  const field = actionKey(key, "instance_id");
  if (number !== 0 || rootOf(doc, "actions").has(field)) writeKey(doc, "actions", field, number);
  eraseKeys(doc, "actions", extraKey(key, "instance_id"), actionKey(key, "twin"));
  const odd = [...rootOf(doc, "relations").keys()].filter((field) => saysNumberOf(field, key));
  eraseKeys(doc, "relations", ...odd);
}

/** Returns true if a key keeps an imported number that refers to the action and did not fit. */
function saysNumberOf(field: string, key: Key): boolean {
  const { head, rest } = splitKey(field);
  const ends = endsOf(head);
  if (rest === "x/children/instance_id") return ends?.child === key;
  return rest === "x/parents/instance_id" && ends?.parent === key;
}

interface ActionFields {
  readonly type: string;
  readonly actor: string;
  readonly description: string;
  readonly instanceId: number;
}

/** Sets one field of an action. A number that another action of the name has is shared out again. */
export function setField<F extends keyof ActionFields>(
  doc: Y.Doc,
  key: Key,
  field: F,
  value: ActionFields[F],
): boolean {
  if (!hasAction(doc, key)) return false;
  asOneEdit(doc, () => {
    if (typeof value === "number") {
      numberGhosts(doc);
      writeNumber(doc, key, value);
      numberGhosts(doc);
      return;
    }
    writeKey(doc, "actions", actionKey(key, field), value);
    eraseKeys(doc, "actions", extraKey(key, field));
  });
  return true;
}

/** Makes a ghost an action of the graph, with its arrows as they are. False when it is gone. */
export function adoptGhost(doc: Y.Doc, key: Key, like: Omit<NewAction, "name"> = {}): boolean {
  if (!hasAction(doc, key)) return false;
  asOneEdit(doc, () => {
    eraseKeys(doc, "actions", actionKey(key, "missing"));
    writeKey(
      doc,
      "actions",
      actionKey(key, "order"),
      nextNumber(doc, "actions", "order", () => true),
    );
    if (like.type) setField(doc, key, "type", like.type);
    if (like.description) setField(doc, key, "description", like.description);
    writeParameters(doc, key, "in", like.inputs ?? []);
    writeParameters(doc, key, "out", like.outputs ?? []);
  });
  return true;
}
