/**
 * Draws an action that is tried again: one more of it for each further try, behind the one before.
 *
 * The engine counts nothing, so a try is an action: it begins when the one before it failed, and what
 * follows comes after whichever does not fail. A failure of the last one is what a failure of the
 * action was before. Where the engine would not do exactly that, `whyNoTries` has the reason and
 * nothing is drawn (decision 157).
 */

import type * as Y from "yjs";
import { isolated } from "../../words/isolated";
import { endsOf, flatName, relationId, rootOf, splitKey } from "../document-keys";
import { memberText } from "../json-members";
import {
  type Action,
  EXIT,
  type Graph,
  type Key,
  type Position,
  PRECONDITIONS,
  type Precondition,
  type Relation,
} from "../model";
import { askedPaths } from "../parameters/asked-inputs";
import { dataFlowOf } from "../parameters/data-flow";
import { nameOf } from "../relation-words";
import { clipOf, paste } from "./clip";
import {
  asOneEdit,
  eraseKeys,
  graphNow,
  keepingWaypoints,
  moveKeys,
  nextNumber,
  writeKey,
} from "./document-writes";
import { draw } from "./relations";

/** The most that one action is tried. */
export const MOST_TRIES = 10;

/** The outcomes after which an action is tried again. */
export type Failures = readonly ("on_error" | "on_false")[];

/** Returns why an action cannot be drawn so that it is tried again; null when it can. */
export function whyNoTries(graph: Graph, key: Key, standsForGraph: boolean): string | null {
  const action = graph.actions.find((each) => each.key === key);
  if (action === undefined || action.missing || action.twin) return "It is not in the graph.";
  if (standsForGraph) return "It stands for a graph, which an engine takes only once.";
  return whyNotBySettings(graph, action) ?? whyNotByArrows(graph, key);
}

function whyNotBySettings(graph: Graph, action: Action): string | null {
  if (graph.actions.some(({ type }) => type === "spontaneous")) {
    return "A spontaneous action of this graph stops what follows it, also between two tries.";
  }
  const [asked] = askedPaths(graph).get(action.key) ?? [];
  if (asked !== undefined) {
    return `A start asks for ${isolated(asked)}, and would ask anew for each try. Give it a value.`;
  }
  const [given] = dataFlowOf(graph).get(action.key)?.keys() ?? [];
  if (given !== undefined) {
    return `${isolated(given)} comes from another action, which gives it to the first try only.`;
  }
  const inputs = new Set(action.inputs.map(({ path }) => flatName(path)));
  const same = action.outputs.find(({ path }) => inputs.has(flatName(path)));
  if (same) return `A failed try would hand its own ${isolated(same.path)} to the next one.`;
  const allowed = action.outputs.find(({ text }) => isObjectWith(text, "pvf_allowed_values"));
  if (allowed) {
    return `After a failure the engine breaks down at ${isolated(allowed.path)}, which has allowed values (H13).`;
  }
  return null;
}

const isObjectWith = (text: string, member: string): boolean =>
  text.trimStart().startsWith("{") && memberText(text, member) !== null;

function whyNotByArrows(graph: Graph, key: Key): string | null {
  const around = graph.relations.filter(({ parent, child }) => parent === key || child === key);
  if (around.some(({ only, listing }) => only !== null || listing > 0)) {
    return "Some of its arrows are listed on one side only, or twice.";
  }
  for (const { parent, child, conditions, required } of around) {
    if (parent === child) return "It leads to itself.";
    const said = PRECONDITIONS.map((outcome) => conditions[outcome]);
    if (child === key && said.some((r) => r === "stop" || r === "pause" || r === "restart")) {
      return `${isolated(nameOf(graph, parent))} stops or pauses it, and would reach the first try only.`;
    }
    const waitsForMore =
      parent === key &&
      required &&
      graph.relations.some((other) => other.child === child && other.parent !== key);
    if (waitsForMore) {
      const waiting = child === EXIT ? "The end" : isolated(nameOf(graph, child));
      return `${waiting} waits for it and for others, and the engine cannot wait for whichever try succeeds.`;
    }
  }
  return null;
}

/** Returns the sentences that a person reads before the tries are drawn. */
export function triesWords(graph: Graph, key: Key, times: number, failures: Failures): string {
  const more = times === 2 ? "one more" : `${times - 1} more`;
  const name = nameOf(graph, key);
  const failure = failures.includes("on_false") ? "an error or false" : "an error";
  const follows = graph.relations.some(
    ({ parent, conditions }) =>
      parent === key && failures.some((end) => conditions[end] !== "ignore"),
  );
  const then = follows
    ? `what now follows ${failure} of ${isolated(name)} begins`
    : "nothing follows";
  return `Draws ${more} of ${isolated(name)}. Each further try begins only if the one before it ended with ${failure}. As soon as one try ends otherwise, the graph goes on from there. If the last one ends with ${failure}, ${then}.`;
}

/**
 * Draws the further tries as one edit; returns the keys of the new actions, in their order, or null
 * where `whyNoTries` has a reason. `places`: of the new cards.
 */
export function drawTries(
  doc: Y.Doc,
  key: Key,
  { failures, places }: { readonly failures: Failures; readonly places: readonly Position[] },
): readonly Key[] | null {
  return asOneEdit(doc, () => {
    if (whyNoTries(graphNow(doc), key, false) !== null) return null;
    const copies = places.map((place) => copied(doc, key, place));
    const tries = [key, ...copies];
    const arrows = graphNow(doc).relations.filter(({ parent }) => parent === key);
    for (const arrow of arrows) share(doc, arrow, tries, failures);
    for (const [i, copy] of copies.entries()) {
      for (const end of failures) draw(doc, tries[i] as Key, copy, end, "run");
    }
    return copies;
  });
}

function copied(doc: Y.Doc, key: Key, place: Position): Key {
  const clip = clipOf(doc, new Set([key]), new Map([[key, place]]));
  return paste(doc, clip, { by: [0, 0] })[0] as Key;
}

/** Gives an arrow of the action to all tries: what it says of failures to the last one alone. */
function share(doc: Y.Doc, arrow: Relation, tries: readonly Key[], failures: Failures): void {
  const [first = "", ...others] = tries;
  const last = others.at(-1) ?? first;
  const id = relationId(arrow);
  const kept = PRECONDITIONS.filter((end) => arrow.conditions[end] !== "ignore");
  if (!kept.some((end) => !isFailure(end, failures))) {
    const to = relationId({ parent: last, child: arrow.child });
    if (kept.length > 0) moveKeys(doc, id, to);
    return;
  }
  const said = keysOf(doc, id);
  const ids = others.map((parent) => relationId({ parent, child: arrow.child }));
  for (const copy of ids) {
    for (const [rest, value] of said) writeKey(doc, "relations", `${copy}|${rest}`, value);
    const order = nextNumber(doc, "relations", "co", (head) => endsOf(head)?.child === arrow.child);
    writeKey(doc, "relations", `${copy}|co`, order);
  }
  for (const each of [id, ...ids]) {
    // Exactly one of them reports what counts, so none can be waited for.
    writeKey(doc, "relations", `${each}|required`, false);
    if (each === ids.at(-1)) continue;
    keepingWaypoints(doc, each, () => {
      for (const end of failures) writeKey(doc, "relations", `${each}|${end}`, "ignore");
    });
    eraseKeys(doc, "relations", `${each}|x/parents/conditions`);
  }
}

const isFailure = (end: Precondition, failures: Failures): boolean =>
  failures.some((each) => each === end);

/** The keys of a relation without its id; imported numbers that did not fit are the parent's own. */
function keysOf(doc: Y.Doc, id: string): [rest: string, value: unknown][] {
  return [...rootOf(doc, "relations").entries()].flatMap(([key, value]) => {
    const { head, rest } = splitKey(key);
    return head === id && !rest.endsWith("/instance_id") ? [[rest, value]] : [];
  });
}
