/**
 * Duplicates actions with another value for each copy: side by side, or as a series in which each copy
 * follows the one before, and what followed the actions follows the last copy.
 *
 * A series is drawn as people draw arrows, so what is waited for follows (`waits.ts`). Other outcomes
 * of the copies lead where those of the actions lead.
 */

import type * as Y from "yjs";
import { counted } from "../../words/counted";
import { isolated } from "../../words/isolated";
import { flatName, relationId } from "../document-keys";
import { pathWords } from "../field-words";
import {
  type Action,
  type Graph,
  type JsonText,
  type Key,
  type Position,
  type Relation,
  spokenOutcomes,
} from "../model";
import { dataFlowOf } from "../parameters/data-flow";
import { parameterValueOf, typed, withValue } from "../parameters/values";
import { nameOf } from "../relation-words";
import { setField } from "./actions";
import { clipOf, paste } from "./clip";
import { asOneEdit, eraseRelation, graphNow, keepingWaypoints, writeKey } from "./document-writes";
import { setParameter } from "./parameters";
import { draw, setRemap } from "./relations";
import { keepingWaits } from "./waits";

/** The most copies that are made at once. */
export const MOST_COPIES = 50;

/** The field that differs in each copy: the robot, or an input of one value, by its path. */
export type Varied = { readonly kind: "robot" } | { readonly kind: "input"; readonly path: string };

/** Returns the paths of the inputs of these actions that can differ, each once. */
export function variedInputs(actions: readonly Action[]): readonly string[] {
  const paths = actions.flatMap(({ inputs }) =>
    inputs.filter(({ text }) => singleType(text) !== null).map(({ path }) => path),
  );
  return [...new Set(paths)];
}

function singleType(text: JsonText): "string" | "number" | "bool" | null {
  const { native } = parameterValueOf(text);
  return native === "string" || native === "number" || native === "bool" ? native : null;
}

/** Returns what is wrong with a value for the copies; null when it can be written. */
export function wrongValue(
  actions: readonly Action[],
  varied: Varied,
  value: string,
): string | null {
  if (varied.kind === "robot") return null;
  for (const { inputs } of actions) {
    const input = inputs.find(({ path }) => path === varied.path);
    const type = input && singleType(input.text);
    const result = type ? typed(type, value) : null;
    if (result && "wrong" in result) return result.wrong;
  }
  return null;
}

/** The beginning and the end of actions that can follow each other as copies. */
interface Piece {
  readonly first: Key;
  readonly last: Key;
}

const runs = (relation: Relation): boolean =>
  Object.values(relation.conditions).some((response) => response === "run");

const INTERRUPTS: ReadonlySet<string> = new Set(["stop", "pause", "restart"]);

const interrupts = (relation: Relation): boolean =>
  Object.values(relation.conditions).some((response) => INTERRUPTS.has(response));

/** Returns the beginning and the end of these actions, or why their copies cannot be a series. */
function pieceOf(graph: Graph, keys: ReadonlySet<Key>, varied: Varied): Piece | string {
  const inside = graph.relations.filter(({ parent, child }) => keys.has(parent) && keys.has(child));
  const begun = new Set(inside.filter(runs).map(({ child }) => child));
  const going = inside.filter(({ conditions }) => conditions.on_true === "run");
  const firsts = [...keys].filter((key) => !begun.has(key));
  const lasts = [...keys].filter((key) => !going.some(({ parent }) => parent === key));
  const [first, last] = [firsts[0], lasts[0]];
  if (firsts.length !== 1 || lasts.length !== 1 || first === undefined || last === undefined) {
    return "These actions have no single beginning and end.";
  }
  const into = graph.relations.find(
    ({ parent, child }) => !keys.has(parent) && keys.has(child) && child !== first,
  );
  if (into) return `An arrow from elsewhere leads to ${isolated(nameOf(graph, into.child))}.`;
  const meddles = graph.relations.find(
    (relation) => relation.child === first && !keys.has(relation.parent) && interrupts(relation),
  );
  if (meddles) {
    return `${isolated(nameOf(graph, meddles.parent))} stops or pauses it, and would reach the first only.`;
  }
  const given = [...(dataFlowOf(graph).get(first) ?? [])].find(([, givers]) =>
    givers.some(({ parent }) => !keys.has(parent)),
  );
  if (given && !(varied.kind === "input" && varied.path === given[0])) {
    return `${isolated(pathWords(given[0]))} comes from another action, which gives it to the first only.`;
  }
  const actions = new Map(graph.actions.map((action) => [action.key, action]));
  const outputs = new Set(actions.get(last)?.outputs.map(({ path }) => flatName(path)));
  const replaced = actions.get(first)?.inputs.find(({ path }) => outputs.has(flatName(path)));
  if (replaced) {
    return `Each copy would get ${isolated(pathWords(replaced.path))} from the one before it.`;
  }
  return { first, last };
}

/** Returns why copies of these actions cannot follow each other; null when they can. */
export function whyNoSeries(graph: Graph, keys: ReadonlySet<Key>, varied: Varied): string | null {
  const piece = pieceOf(graph, keys, varied);
  return typeof piece === "string" ? piece : null;
}

/** Returns the sentence that a person reads before the copies are drawn. */
export function copiesWords(
  graph: Graph,
  keys: ReadonlySet<Key>,
  varied: Varied,
  copies: { readonly values: readonly string[]; readonly inSeries: boolean },
): string {
  const names = [...keys].map((key) => isolated(nameOf(graph, key)));
  const what = names.length > 3 ? counted(names.length, "action") : names.join(", ");
  const field = varied.kind === "robot" ? "robot" : isolated(pathWords(varied.path));
  const values = copies.values.map(isolated).join(", ");
  const where = copies.inSeries
    ? `one after another behind it${onwardWords(graph, keys, varied)}`
    : "side by side, with no arrows from elsewhere";
  const count = copies.values.length;
  return `Draws ${count === 1 ? "one copy" : `${count} copies`} of ${what} with ${field} ${values}, ${where}.`;
}

function onwardWords(graph: Graph, keys: ReadonlySet<Key>, varied: Varied): string {
  const piece = pieceOf(graph, keys, varied);
  if (typeof piece === "string") return "";
  const goesOn = graph.relations.some(
    ({ parent, child, conditions }) =>
      parent === piece.last && !keys.has(child) && conditions.on_true !== "ignore",
  );
  const last = isolated(nameOf(graph, piece.last));
  return goesOn ? `; the last copy leads on to what followed ${last} when it ended true` : "";
}

/**
 * Draws one copy of the actions for each value, as one edit; returns the keys of each copy. `by`: how
 * far each copy stands from the actions. A series that cannot be drawn is not drawn: null.
 */
export function drawCopies(
  doc: Y.Doc,
  keys: ReadonlySet<Key>,
  varied: Varied,
  copies: {
    readonly values: readonly string[];
    readonly inSeries: boolean;
    readonly by: readonly Position[];
    readonly places: ReadonlyMap<Key, Position>;
  },
): readonly (readonly Key[])[] | null {
  const { values, inSeries, by, places } = copies;
  return asOneEdit(doc, () => {
    const graph = graphNow(doc);
    const piece = inSeries ? pieceOf(graph, keys, varied) : null;
    if (typeof piece === "string") return null;
    // In the order in which `paste` answers.
    const order = graph.actions.filter(({ key }) => keys.has(key)).map(({ key }) => key);
    const made = values.map((value, i) => {
      const pasted = paste(doc, clipOf(doc, keys, places), { by: by[i] ?? [0, 0] });
      for (const key of pasted) vary(doc, key, varied, value);
      return new Map(order.map((key, at) => [key, pasted[at] as Key]));
    });
    if (piece !== null) keepingWaits(doc, () => chain(doc, graph, piece, made));
    return made.map((copy) => [...copy.values()]);
  });
}

function vary(doc: Y.Doc, key: Key, varied: Varied, value: string): void {
  if (varied.kind === "robot") {
    setField(doc, key, "actor", value);
    return;
  }
  setParameter(doc, key, "in", varied.path, (now) => {
    const type = singleType(now);
    const result = type === null ? null : typed(type, value);
    return result && "ok" in result ? withValue(now, result.ok) : now;
  });
}

/** Leads each copy on to the next one, and the last one to what followed. */
function chain(
  doc: Y.Doc,
  graph: Graph,
  { first, last }: Piece,
  made: readonly ReadonlyMap<Key, Key>[],
): void {
  const own = new Set(made[0]?.keys());
  const onward = graph.relations
    .filter(({ parent, child }) => own.has(parent) && !own.has(child))
    .sort((a, b) => a.parentOrder - b.parentOrder);
  for (const [i, copy] of made.entries()) {
    const isLast = i === made.length - 1;
    for (const relation of onward) {
      const parent = copy.get(relation.parent) as Key;
      for (const end of spokenOutcomes(relation.conditions)) {
        if (!isLast && relation.parent === last && end === "on_true") continue;
        const id = draw(doc, parent, relation.child, end, relation.conditions[end]);
        for (const { source, target } of relation.remap) if (id) setRemap(doc, id, source, target);
      }
    }
  }
  for (const relation of onward) if (relation.parent === last) leaveOff(doc, relation);
  const firsts = made.map((copy) => copy.get(first) as Key);
  const lasts = [last, ...made.map((copy) => copy.get(last) as Key)];
  for (const [i, next] of firsts.entries()) draw(doc, lasts[i] as Key, next, "on_true", "run");
}

/** Takes from an arrow what it says when all goes well. */
function leaveOff(doc: Y.Doc, relation: Relation): void {
  const id = relationId(relation);
  const said = spokenOutcomes(relation.conditions);
  if (!said.includes("on_true")) return;
  if (said.length === 1) eraseRelation(doc, id);
  else keepingWaypoints(doc, id, () => writeKey(doc, "relations", `${id}|on_true`, "ignore"));
}
