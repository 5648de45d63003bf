/** Documents for tests of edits: made, copied for a colleague, and read as a graph. */

import * as Y from "yjs";
import { mapsOf, relationId } from "../graph/document-keys";
import { addAction } from "../graph/edit";
import { type Graph, type Key, type Relation, spokenOutcomes } from "../graph/model";
import { readGraph } from "../graph/read";

export const graphIn = (doc: Y.Doc): Graph => readGraph(mapsOf(doc));
export const actionIn = (doc: Y.Doc, key: Key) => graphIn(doc).actions.find((a) => a.key === key);
export const relationIn = (doc: Y.Doc, id: string | null): Relation | undefined =>
  graphIn(doc).relations.find((relation) => relationId(relation) === id);
export const says = (relation: Relation | undefined) =>
  relation && spokenOutcomes(relation.conditions).map((o) => `${o} -> ${relation.conditions[o]}`);
export const arrows = (doc: Y.Doc) =>
  graphIn(doc)
    .relations.map((relation) => {
      const name = (key: Key) => actionIn(doc, key)?.name ?? key;
      return `${name(relation.parent)}>${name(relation.child)}`;
    })
    .sort();

export function docWith(...names: string[]): [Y.Doc, ...Key[]] {
  const doc = new Y.Doc();
  return [doc, ...names.map((name) => addAction(doc, { name }))];
}

/** Returns a copy of the document, as a colleague has it. */
export function copyOf(doc: Y.Doc): Y.Doc {
  const copy = new Y.Doc();
  Y.applyUpdate(copy, Y.encodeStateAsUpdate(doc));
  return copy;
}

export function exchange(...docs: Y.Doc[]): void {
  for (const from of docs) {
    for (const to of docs) {
      Y.applyUpdate(to, Y.encodeStateAsUpdate(from, Y.encodeStateVector(to)), "remote");
    }
  }
}

export function updatesOf(doc: Y.Doc, work: () => void): number {
  let count = 0;
  const onUpdate = () => {
    count += 1;
  };
  doc.on("update", onUpdate);
  work();
  doc.off("update", onUpdate);
  return count;
}
