/**
 * Sets which arrows and outputs the end of a graph waits for, so that what is drawn ends on the engine.
 *
 * The engine's exit waits for every arrow that is required, and for the outputs of the last action
 * that leads to it and has any. Where one thing happens after the other, whatever reaches the end
 * shall end the graph; where things run side by side, the end has to wait: they would run on in a
 * graph that no stop reaches any more.
 */

import type * as Y from "yjs";
import { endsOf, parameterKey, relationId, rootOf, splitKey } from "../document-keys";
import { memberText, withMember } from "../json-members";
import { ENTRY, EXIT, type Graph, type Key, type Parameter, PRECONDITIONS } from "../model";
import { eraseKeys, graphNow, writeKey } from "./document-writes";

/** Does an edit of arrows, and makes the end wait for what it now has to wait for. */
export function keepingEnds<T>(doc: Y.Doc, work: () => T): T {
  const wasApart = severalEnds(doc) && sideBySide(graphNow(doc));
  const done = work();
  if (!severalEnds(doc)) {
    if (failureEnds(doc)) optionalOutputs(doc, graphNow(doc));
    return done;
  }
  const graph = graphNow(doc);
  if (sideBySide(graph)) {
    if (!wasApart) for (const id of ends(graph)) eraseKeys(doc, "relations", `${id}|required`);
  } else if (allReached(graph)) {
    for (const id of ends(graph)) writeKey(doc, "relations", `${id}|required`, false);
  }
  if (failureEnds(doc) || outputsDiffer(graph)) optionalOutputs(doc, graph);
  return done;
}

/** Makes all outputs of this action optional, so that the end of the graph does not wait for them. */
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

const ends = (graph: Graph): string[] =>
  graph.relations.filter(({ child }) => child === EXIT).map(relationId);

/** Returns true if two actions may run at the same time, judged by the arrows alone. */
function sideBySide(graph: Graph): boolean {
  if (graph.actions.some(({ type }) => type === "spontaneous")) return true;
  const asked = new Set<string>();
  for (const { parent, conditions } of graph.relations) {
    for (const outcome of parent === ENTRY ? (["on_true"] as const) : PRECONDITIONS) {
      if (parent !== ENTRY && conditions[outcome] === "ignore") continue;
      const one = `${parent}|${outcome}`;
      if (asked.has(one)) return true;
      asked.add(one);
    }
  }
  return false;
}

/** Returns true if there is a way from the start to every action that leads to the end. */
function allReached(graph: Graph): boolean {
  const next = new Map<Key, Key[]>();
  for (const { parent, child } of graph.relations) {
    next.set(parent, [...(next.get(parent) ?? []), child]);
  }
  const reached = new Set<Key>([ENTRY]);
  for (const key of reached) for (const child of next.get(key) ?? []) reached.add(child);
  return graph.relations.every(({ parent, child }) => child !== EXIT || reached.has(parent));
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
