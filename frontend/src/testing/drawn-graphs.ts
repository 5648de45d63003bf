/** Graphs that are drawn by the gestures of people, in any order, for tests. */
import fc from "fast-check";
import type * as Y from "yjs";
import { relationId } from "../graph/document-keys";
import { addAction, connect, insertInto, retarget, setEntry, setExit } from "../graph/edit";
import {
  ENTRY,
  EXIT,
  type Key,
  type Precondition,
  type Relation,
  spokenOutcomes,
} from "../graph/model";
import { docWith, graphIn } from "./edited-graph";

type Gesture = readonly [kind: string, one: number, other: number, when: Precondition];

/** Gestures of people who draw, in any order. */
export const gestures = fc.array(
  fc.tuple(
    fc.constantFrom("grow", "grow", "grow", "join", "back", "end", "insert", "lead", "handle"),
    fc.nat(99),
    fc.nat(99),
    fc.constantFrom<Precondition>("on_true", "on_true", "on_true", "on_false", "on_error"),
  ) as fc.Arbitrary<Gesture>,
  { minLength: 3, maxLength: 16 },
);

/**
 * Draws a graph by gestures as people make them, in any order. Each action that would end a branch
 * when all goes well is led to the end last.
 */
export function drawnBy(all: readonly Gesture[]): Y.Doc {
  const [doc, first] = docWith("A0") as [Y.Doc, Key];
  const keys = [first];
  const pick = (n: number) => keys[n % keys.length] as Key;
  const ahead = (from: Key, to: Key) => keys.indexOf(from) < keys.indexOf(to);
  const add = () => {
    keys.push(addAction(doc, { name: `A${keys.length}` }));
    return keys.at(-1) as Key;
  };
  setEntry(doc, first);
  for (const [kind, one, other, when] of all) {
    const [from, to] = [pick(one), pick(other)];
    const relations = inOrder(doc).filter(({ parent }) => parent !== ENTRY);
    const relation = relations[one % Math.max(1, relations.length)];
    if (kind === "grow") connect(doc, from, add(), when);
    else if (kind === "join" && ahead(from, to)) connect(doc, from, to, when);
    else if (kind === "back" && ahead(to, from)) {
      connect(doc, from, to, when === "on_true" ? "on_false" : when);
    } else if (kind === "end") setExit(doc, from, when);
    else if (kind === "handle") connect(doc, from, add(), "on_error");
    else if (kind === "insert" && relation) {
      const key = add();
      // Whatever follows stands after it in `keys`, so that "ahead" still means ahead.
      keys.splice(keys.indexOf(relation.parent) + 1, 0, ...keys.splice(-1));
      insertInto(doc, relationId(relation), key);
    } else if (kind === "lead" && relation && ahead(relation.parent, to)) {
      const [said] = spokenOutcomes(relation.conditions);
      if (said) retarget(doc, relationId(relation), said, { child: to });
    }
  }
  for (const key of keys) {
    const goesOn = graphIn(doc).relations.some(
      ({ parent, child, conditions }) =>
        parent === key && conditions.on_true === "run" && (child === EXIT || ahead(key, child)),
    );
    if (!goesOn) setExit(doc, key);
  }
  return doc;
}

/** Returns the names of all actions by key, with their numbers unless those are 0. */
export function namesIn(doc: Y.Doc): (key: Key) => string {
  const names = new Map(
    graphIn(doc).actions.map(({ key, name, instanceId }) => [
      key,
      instanceId === 0 ? name : `${name}#${instanceId}`,
    ]),
  );
  return (key) => names.get(key) ?? key;
}

/** Returns the arrows by the names of their parents, in the order in which each starts its children. */
function inOrder(doc: Y.Doc): Relation[] {
  const named = namesIn(doc);
  return [...graphIn(doc).relations].sort(
    (a, b) => named(a.parent).localeCompare(named(b.parent)) || a.parentOrder - b.parentOrder,
  );
}

/** One line for each arrow: parent, child, its outcomes, and `?` if it is not waited for. */
export function arrowsOf(doc: Y.Doc): string[] {
  const named = namesIn(doc);
  return inOrder(doc).map(({ parent, child, conditions, required }) =>
    [
      named(parent),
      named(child),
      spokenOutcomes(conditions)
        .map((outcome) => outcome.slice(3))
        .join("/"),
      ...(required ? [] : ["?"]),
    ].join(" "),
  );
}

/** True if what follows on_true leads in a circle, which never ends when every action ends true. */
export function goesInCircles(arrows: readonly string[]): boolean {
  const next = arrows
    .map((arrow) => arrow.split(" ") as [string, string, string])
    .filter(([, , when]) => when.includes("true"));
  const left = new Set(next.flatMap((arrow) => arrow.slice(0, 2)));
  for (let before = -1; before !== left.size; ) {
    before = left.size;
    for (const key of left) {
      if (!next.some(([parent, child]) => parent === key && left.has(child))) left.delete(key);
    }
  }
  return left.size > 0;
}
