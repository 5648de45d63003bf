/**
 * Keeps what is waited for right while arrows are drawn, so that what is drawn ends on the engine.
 *
 * What an arrow needs follows from all arrows together (`graph/waiting.ts`): after a decision
 * nothing waits for the other branch, after a fork everything waits for all. An edit writes what an
 * arrow needs only where that has changed by the edit, and only over the value that was needed
 * before: a choice that a person or a file made otherwise stays. The end of a graph also waits for
 * the outputs of the last action that leads to it and has any.
 */

import type * as Y from "yjs";
import { endsOf, parameterKey, relationId, rootOf, splitKey } from "../document-keys";
import { memberText, withMember } from "../json-members";
import { EXIT, type Graph, type Key, type Parameter } from "../model";
import { type Waits, waitsOf } from "../waiting";
import { eraseKeys, graphNow, writeKey } from "./document-writes";

/** Does an edit of arrows, and makes actions and the end wait for what they now have to wait for. */
export function keepingWaits<T>(doc: Y.Doc, work: () => T): T {
  const before = hasJoin(doc) ? graphNow(doc) : null;
  const known = new Set(before?.relations.map(relationId) ?? relationsOf(doc));
  const done = work();
  const joined = hasJoin(doc);
  if (joined) writeWaits(doc, before === null ? new Map() : waitsOf(before), known);
  if (severalEnds(doc)) {
    const graph = graphNow(doc);
    if (failureEnds(doc) || outputsDiffer(graph)) optionalOutputs(doc, graph);
  } else if (failureEnds(doc)) optionalOutputs(doc, graphNow(doc));
  return done;
}

/** Writes which arrows are waited for, where this edit has changed it. `known`: the arrows from before the edit. */
function writeWaits(doc: Y.Doc, before: Waits, known: ReadonlySet<string>): void {
  const graph = graphNow(doc);
  const needed = waitsOf(graph);
  for (const relation of graph.relations) {
    const id = relationId(relation);
    const now = needed.get(id);
    const then = before.get(id) ?? true;
    const isFree = !known.has(id) || (then !== now && relation.required === then);
    if (now === undefined || relation.required === now || !isFree) continue;
    if (now) eraseKeys(doc, "relations", `${id}|required`);
    else writeKey(doc, "relations", `${id}|required`, false);
  }
}

/** The ids of all relations that have keys. */
function relationsOf(doc: Y.Doc): Set<string> {
  return new Set([...rootOf(doc, "relations").keys()].map((key) => splitKey(key).head));
}

/** Returns true if several arrows lead to one action or to the end, without reading the whole graph. */
function hasJoin(doc: Y.Doc): boolean {
  const first = new Map<Key, string>();
  for (const key of rootOf(doc, "relations").keys()) {
    const { head } = splitKey(key);
    const child = endsOf(head)?.child;
    if (child === undefined) continue;
    const other = first.get(child);
    if (other === undefined) first.set(child, head);
    else if (other !== head) return true;
  }
  return false;
}

/**
 * Makes all outputs of this action optional, so that the end of the graph does not wait for them. False
 * when it waits for none.
 */
export function setOutputsOptional(doc: Y.Doc, key: Key): boolean {
  const action = graphNow(doc).actions.find((candidate) => candidate.key === key);
  const waited = action?.outputs.filter(({ text }) => isWaitedFor(text)) ?? [];
  for (const { path, text } of waited) {
    writeKey(
      doc,
      "actions",
      parameterKey(key, "out", path),
      withMember(text, "pvf_required", "false"),
    );
  }
  return waited.length > 0;
}

/** An output without a value is there only when its action has run. */
function isWaitedFor(text: string): boolean {
  return (
    text.trimStart().startsWith("{") &&
    memberText(text, "pvf_type") !== null &&
    memberText(text, "pvf_value") === null &&
    memberText(text, "pvf_required") !== "false"
  );
}

/** Returns true if more than one action leads to the end, without reading the whole graph. */
function severalEnds(doc: Y.Doc): boolean {
  const parents = new Set<Key>();
  for (const key of rootOf(doc, "relations").keys()) {
    const found = endsOf(splitKey(key).head);
    if (found?.child === EXIT) parents.add(found.parent);
    if (parents.size > 1) return true;
  }
  return false;
}

/** Returns true if a failed action may end the graph; it has no outputs then. */
function failureEnds(doc: Y.Doc): boolean {
  const map = rootOf(doc, "relations");
  for (const key of map.keys()) {
    const { head, rest } = splitKey(key);
    const answer = rest === "on_error" && endsOf(head)?.child === EXIT && map.get(key);
    if (typeof answer === "string" && answer !== "ignore" && answer !== "bypass") return true;
  }
  return false;
}

function outputsDiffer(graph: Graph): boolean {
  const named = (outputs: readonly Parameter[]) =>
    outputs
      .map(({ path }) => path)
      .sort()
      .join("\n");
  return new Set(leading(graph).map(({ outputs }) => named(outputs))).size > 1;
}

function optionalOutputs(doc: Y.Doc, graph: Graph): void {
  for (const { key } of leading(graph)) setOutputsOptional(doc, key);
}

/** The actions that lead to the end. */
function leading(graph: Graph) {
  const keys = new Set(graph.relations.flatMap((r) => (r.child === EXIT ? [r.parent] : [])));
  return graph.actions.filter(({ key }) => keys.has(key));
}
