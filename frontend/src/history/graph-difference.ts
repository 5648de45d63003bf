/**
 * Differences between two moments of a graph, as things to mark, to list and to step through. Pure.
 */
import type { ChangeMark, ChangeMarks } from "../canvas/marks/change-marks";
import { type FieldChange, linesOf } from "../differences/difference-words";
import { relationId } from "../graph/document-keys";
import { notesOf, readNote } from "../graph/edit/notes";
import { fieldWords } from "../graph/field-words";
import {
  type Action,
  fullName,
  type Graph,
  type Key,
  PRECONDITIONS,
  type Relation,
} from "../graph/model";
import { cardRows } from "../graph/parameters/card-rows";
import { endLabel, spokenName } from "../graph/spoken-name";
import { isEqual } from "../graph/values";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";

export interface ChangedThing {
  readonly key: string;
  readonly thing: "graph" | "action" | "arrow" | "note";
  readonly change: ChangeMark["change"];
  /** True if only its place, or the way of its line, has changed. */
  readonly looks: boolean;
  readonly name: string;
  readonly lines: ReturnType<typeof linesOf>;
}

export interface GraphChanges {
  readonly before: Graph;
  /** The later graph, with what is gone where it stood. */
  readonly shown: Graph;
  readonly things: readonly ChangedThing[];
  readonly marks: ChangeMarks;
}

type Fields = ReadonlyMap<string, unknown>;

function changedFields(before: Fields, after: Fields): FieldChange[] {
  const names = [...new Set([...before.keys(), ...after.keys()])];
  const inOrder = names.sort((a, b) => (fieldWords(a) < fieldWords(b) ? -1 : 1));
  return inOrder.flatMap((field) => {
    const [was, is] = [before.get(field) ?? null, after.get(field) ?? null];
    return isEqual(was, is) ? [] : [{ field, before: was, after: is }];
  });
}

const actionFields = (action: Action): Fields =>
  new Map<string, unknown>([
    ["name", spokenName(fullName(action))],
    ["type", action.type],
    ["actor", action.actor],
    ["description", action.description],
    ...action.inputs.map(({ path, text }) => [`in/${path}`, text] as const),
    ...action.outputs.map(({ path, text }) => [`out/${path}`, text] as const),
    ...action.extra,
  ]);

const relationFields = (relation: Relation): Fields =>
  new Map<string, unknown>([
    ...PRECONDITIONS.map((on) => [on, relation.conditions[on]] as const),
    ["required", relation.required],
    ...relation.remap.map(({ source, target }) => [`remap/${source}`, target] as const),
  ]);

/** Return the fields of a note; position and size are apart from its text. */
function noteFields([id, json]: readonly [string, string]): Fields {
  const note = readNote(`g/${id}`, json);
  return new Map([["text", note?.text ?? json]]);
}

const graphFields = (graph: Graph): Fields =>
  new Map<string, unknown>([
    ["name", graph.name],
    ["description", graph.description],
    ...graph.extra,
  ]);

/** Return the old values of the rows of a card whose values changed, by row. */
function oldValues(before: Action, after: Action): ReadonlyMap<string, string> {
  const rows = new Map(cardRows(before.inputs).map(({ name, text }) => [name, text]));
  const found = cardRows(after.inputs).flatMap(({ name, text }) => {
    const was = rows.get(name);
    return was === undefined || was === text ? [] : [[name, was] as const];
  });
  return new Map(found);
}

/** Caches comparisons by the later of two things, which stays the same object from step to step. */
class Remembered<T> {
  readonly #found = new WeakMap<object, { readonly before: unknown; readonly is: T }>();

  of(before: unknown, after: unknown, compare: () => T): T {
    if (typeof after !== "object" || after === null) return compare();
    const known = this.#found.get(after);
    if (known !== undefined && known.before === before) return known.is;
    const is = compare();
    this.#found.set(after, { before, is });
    return is;
  }
}

const equal = new Remembered<boolean>();
const told = new Remembered<ReturnType<typeof linesOf>>();

interface BeforeAfter<T> {
  readonly key: string;
  readonly before: T | undefined;
  readonly after: T | undefined;
}

/**
 * Return pairs of both sides, in the order of the later one; pairs of identical objects are left
 * out.
 */
function pairs<T>(
  before: readonly T[],
  after: readonly T[],
  keyOf: (each: T) => string,
): BeforeAfter<T>[] {
  const was = new Map(before.map((each) => [keyOf(each), each]));
  const is = new Map(after.map((each) => [keyOf(each), each]));
  return [...new Set([...is.keys(), ...was.keys()])].flatMap((key) => {
    const pair = { key, before: was.get(key), after: is.get(key) };
    const { before, after } = pair;
    return equal.of(before, after, () => isEqual(before, after)) ? [] : [pair];
  });
}

const changeOf = (pair: BeforeAfter<unknown>): ChangeMark["change"] => {
  if (pair.before === undefined) return "added";
  return pair.after === undefined ? "removed" : "changed";
};

/** `fields`: what it says; null where it says the same and only looks otherwise. */
function thingOf<T>(
  pair: BeforeAfter<T>,
  thing: ChangedThing["thing"],
  name: string,
  fieldsOf: (each: T) => Fields,
): ChangedThing {
  const { key, before, after } = pair;
  const both = before !== undefined && after !== undefined;
  const lines = both
    ? told.of(before, after, () => linesOf(changedFields(fieldsOf(before), fieldsOf(after))))
    : [];
  return { key, thing, change: changeOf(pair), looks: both && lines.length === 0, name, lines };
}

/**
 * Return the fields in which two states of an action differ; null if none do, or only its looks.
 */
export function changedAction(before: Action, after: Action): FieldChange[] | null {
  const fields = isEqual(before, after)
    ? []
    : changedFields(actionFields(before), actionFields(after));
  return fields.length === 0 ? null : fields;
}

/** Return the fields in which two states of an arrow differ; null if none do, or only its looks. */
export function changedRelation(before: Relation, after: Relation): FieldChange[] | null {
  const fields = isEqual(before, after)
    ? []
    : changedFields(relationFields(before), relationFields(after));
  return fields.length === 0 ? null : fields;
}

function namesOf(...graphs: readonly Graph[]): (key: Key) => string {
  const names = new Map<Key, string>();
  for (const graph of graphs)
    for (const action of graph.actions) names.set(action.key, spokenName(fullName(action)));
  return (key) => endLabel(key) ?? names.get(key) ?? "an action";
}

const isGone = (pair: BeforeAfter<unknown>): boolean => pair.after === undefined;

/** The later graph and, where they stood, the actions, arrows and notes that are gone. */
function withGhosts(
  after: Graph,
  actions: readonly BeforeAfter<Action>[],
  relations: readonly BeforeAfter<Relation>[],
  notes: readonly BeforeAfter<readonly [string, string]>[],
): Graph {
  const gone = <T>(all: readonly BeforeAfter<T>[]) =>
    all.flatMap((pair) => (isGone(pair) && pair.before !== undefined ? [pair.before] : []));
  const ghosts = gone(actions);
  const [arrows, papers] = [gone(relations), gone(notes)];
  if (ghosts.length + arrows.length + papers.length === 0) return after;
  return {
    ...after,
    actions: [...after.actions, ...ghosts],
    relations: [...after.relations, ...arrows],
    notes: [...after.notes, ...papers],
  };
}

/**
 * Returns the changes from one graph to another. `by`: the name of who set something in a thing last, where that is
 * known.
 */
export function changesBetween(
  before: Graph,
  after: Graph,
  by: (key: string) => string | null,
): GraphChanges {
  const actions = pairs(before.actions, after.actions, ({ key }) => key);
  const relations = pairs(before.relations, after.relations, relationId);
  const notes = pairs(before.notes, after.notes, ([id]) => `g/${id}`);
  const nameOf = namesOf(before, after);
  const shown = withGhosts(after, actions, relations, notes);
  const texts = new Map([...notesOf(before), ...notesOf(after)].map((n) => [n.key, n.text]));
  const graph = { key: "", before, after };
  const things: ChangedThing[] = [
    ...actions.map((pair) => thingOf(pair, "action", nameOf(pair.key), actionFields)),
    ...relations.map((pair) => {
      const ends = pair.after ?? pair.before;
      const name = ends ? `${isolated(nameOf(ends.parent))} → ${isolated(nameOf(ends.child))}` : "";
      return thingOf(pair, "arrow", name, relationFields);
    }),
    ...notes.map((pair) => {
      const text = texts.get(pair.key)?.replace(/\s+/g, " ").slice(0, 40) || "a note";
      return thingOf(pair, "note", text, noteFields);
    }),
    ...[thingOf(graph, "graph", "The graph", graphFields)].filter(({ looks }) => !looks),
  ];
  const pairOf = new Map(actions.map((pair) => [pair.key, pair]));
  const marks = things.flatMap((thing): [string, ChangeMark][] => {
    if (thing.looks || thing.thing === "graph") return [];
    const pair = pairOf.get(thing.key);
    const both = pair?.before && pair.after ? ([pair.before, pair.after] as const) : null;
    const renamed = both !== null && both[0].name !== both[1].name ? both[0].name : null;
    const old = both === null ? NO_VALUES : oldValues(...both);
    const { change } = thing;
    return [[thing.key, { change, by: by(thing.key), oldName: renamed, oldValues: old }]];
  });
  return { before, shown, things, marks: new Map(marks) };
}

const NO_VALUES: ReadonlyMap<string, string> = new Map();

/**
 * Returns the number of things with one kind of change, as `1 card, 2 arrows`, without
 * changes of looks; "" where there is none.
 */
export function countWords(things: readonly ChangedThing[], change: ChangeMark["change"]): string {
  const of = things.filter((each) => !each.looks && each.change === change);
  const count = (thing: ChangedThing["thing"]) => of.filter((each) => each.thing === thing).length;
  return [
    ...(count("action") > 0 ? [counted(count("action"), "card")] : []),
    ...(count("arrow") > 0 ? [counted(count("arrow"), "arrow")] : []),
    ...(count("note") > 0 ? [counted(count("note"), "note")] : []),
    ...(count("graph") > 0 ? ["the graph"] : []),
  ].join(", ");
}

/** Sorts changes for walking through; changes of looks come last. */
export function walkOrder(things: readonly ChangedThing[]): ChangedThing[] {
  return [...things].sort((a, b) => Number(a.looks) - Number(b.looks));
}
