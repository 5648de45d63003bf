/** Compares graphs by what they say, apart from how they are drawn: equal texts for equal tasks. */

import { isolated } from "../words/isolated";
import { fieldWords, pathWords, shortText, valueText } from "./field-words";
import {
  type Action,
  ENTRY,
  EXIT,
  fullName,
  type Graph,
  type Key,
  type Parameter,
  PRECONDITIONS,
} from "./model";

function value(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

/** Values with the members of objects in one order. */
function ordered(inner: unknown): unknown {
  if (Array.isArray(inner)) return inner.map(ordered);
  if (typeof inner !== "object" || inner === null) return inner;
  return Object.entries(inner)
    .map(([name, member]) => [name, ordered(member)])
    .sort(([a], [b]) => (String(a) < String(b) ? -1 : 1));
}

function parameters(list: readonly Parameter[]): unknown {
  return list.map(({ path, text }) => `${path} ${JSON.stringify(ordered(value(text)))}`).sort();
}

type MeaningEntry = readonly [name: string, ...rest: unknown[]];

/** Returns the content of each action and each arrow, by the names that the engine knows. */
function said(graph: Graph): { actions: MeaningEntry[]; arrows: MeaningEntry[] } {
  const names = new Map<Key, string>(graph.actions.map((action) => [action.key, fullName(action)]));
  names.set(ENTRY, ">").set(EXIT, "<");
  const actions = graph.actions
    .filter((action) => !action.missing)
    .map(
      (action): MeaningEntry => [
        fullName(action),
        action.type,
        action.actor,
        action.description,
        parameters(action.inputs),
        parameters(action.outputs),
      ],
    );
  const arrows = graph.relations
    .filter(({ parent, child }) => names.has(parent) && names.has(child))
    .map(
      (relation): MeaningEntry => [
        names.get(relation.parent) ?? "",
        names.get(relation.child),
        relation.parent === ENTRY
          ? []
          : PRECONDITIONS.map((outcome) => relation.conditions[outcome]),
        relation.required || relation.parent === ENTRY,
        relation.remap.map(({ source, target }) => `${source}>${target}`).sort(),
      ],
    );
  return { actions, arrows };
}

export function meaning(graph: Graph): string {
  const { actions, arrows } = said(graph);
  const sorted = (list: readonly MeaningEntry[]) => list.map((item) => JSON.stringify(item)).sort();
  return JSON.stringify([graph.name, graph.description, sorted(actions), sorted(arrows)]);
}

export interface MeaningDifference {
  readonly kind: "added" | "removed" | "changed";
  readonly what: string;
  /** The changed fields, from the old value to the new one: "delay: 0.5 → 0.9". */
  readonly details: readonly string[];
}

/** Returns the differences in what two graphs do, thing by thing; how they are drawn does not count. */
export function differences(before: Graph, after: Graph): MeaningDifference[] {
  const [old, now] = [said(before), said(after)];
  const ends = (name: string) => (name === ">" ? "Start" : name === "<" ? "End" : name);
  const head =
    before.name !== after.name || before.description !== after.description
      ? [{ kind: "changed", what: "Name or description of the graph", details: [] } as const]
      : [];
  const arrow = ([parent, child]: MeaningEntry) =>
    `Arrow ${isolated(ends(parent))} → ${isolated(ends(String(child)))}`;
  return [
    ...head,
    ...compared(
      old.actions,
      now.actions,
      ([name]) => `Action ${isolated(name)}`,
      (name) => {
        const found = (graph: Graph) => graph.actions.find((each) => fullName(each) === name);
        return inAction(found(before), found(after));
      },
    ),
    ...compared(old.arrows, now.arrows, arrow, (_, was, is) => inArrow(was, is)),
  ];
}

const LONGEST = 60; // characters of a value

function becomes(what: string, was: string, is: string): string[] {
  return was === is ? [] : [`${what}: ${shortText(was, LONGEST)} → ${shortText(is, LONGEST)}`];
}

/** Returns the changed fields of an action, in words. */
function inAction(was: Action | undefined, is: Action | undefined): string[] {
  if (was === undefined || is === undefined) return [];
  return [
    ...becomes("type", was.type, is.type),
    ...becomes(fieldWords("actor"), was.actor || "any", is.actor || "any"),
    ...inParameters(was.inputs, is.inputs),
    ...inParameters(was.outputs, is.outputs, "output "),
    ...(was.description === is.description ? [] : ["its description"]),
  ];
}

function inParameters(was: readonly Parameter[], is: readonly Parameter[], side = ""): string[] {
  const said = (list: readonly Parameter[]) => new Map(list.map((each) => [each.path, each]));
  const [old, now] = [said(was), said(is)];
  return [...new Set([...old.keys(), ...now.keys()])].flatMap((path) => {
    const what = `${side}${pathWords(path)}`;
    const [before, after] = [old.get(path), now.get(path)];
    if (before === undefined || after === undefined) {
      return [`${what} ${before === undefined ? "is new" : "is gone"}`];
    }
    if (
      JSON.stringify(ordered(value(before.text))) === JSON.stringify(ordered(value(after.text)))
    ) {
      return [];
    }
    const values = [before, after].map((each) => valueText(each) ?? "no value");
    const changed = becomes(what, values[0] ?? "", values[1] ?? "");
    return changed.length > 0 ? changed : [`${what}: what is said of it`];
  });
}

/** Returns the changed parts of an arrow, in words: responses, whether it is waited for, and renamings. */
function inArrow(was: MeaningEntry, is: MeaningEntry): string[] {
  const responses = (said: MeaningEntry) => said[2] as readonly string[];
  const answers = PRECONDITIONS.flatMap((outcome, i) =>
    becomes(outcome.replace("_", " "), responses(was)[i] ?? "", responses(is)[i] ?? ""),
  );
  const waited = (said: MeaningEntry) => (said[3] ? "yes" : "no");
  const renamed = (said: MeaningEntry) => (said[4] as readonly string[]).join(", ") || "nothing";
  return [
    ...answers,
    ...becomes("is waited for", waited(was), waited(is)),
    ...becomes("renames", renamed(was), renamed(is)),
  ];
}

function compared(
  before: readonly MeaningEntry[],
  after: readonly MeaningEntry[],
  named: (said: MeaningEntry) => string,
  detailed: (name: string, was: MeaningEntry, is: MeaningEntry) => string[],
): MeaningDifference[] {
  const byName = (list: readonly MeaningEntry[]) =>
    new Map(list.map((item) => [named(item), item]));
  const [old, now] = [byName(before), byName(after)];
  const found: MeaningDifference[] = [];
  for (const [what, is] of now) {
    const was = old.get(what);
    if (was === undefined) found.push({ kind: "added", what, details: [] });
    else if (JSON.stringify(was) !== JSON.stringify(is)) {
      found.push({ kind: "changed", what, details: detailed(is[0], was, is) });
    }
  }
  for (const what of old.keys()) {
    if (!now.has(what)) found.push({ kind: "removed", what, details: [] });
  }
  return found;
}
