/** Edited JSON as an edit of the document, and what others changed meanwhile. Pure but for the edit. */
import type * as Y from "yjs";
import type { KeyChange } from "../../api/documents/texts";
import { bundleOfKey, endsOf, ROOTS, type Root, rootOf, splitKey } from "../../graph/document-keys";
import { asOneEdit } from "../../graph/edit/document-writes";
import { isEqual } from "../../graph/equal";
import { ENTRY, EXIT, type Graph, type Key } from "../../graph/model";

const isRoot = (root: string): root is Root => ROOTS.some((known) => known === root);

/** Those of the changes that would write over what somebody wrote since the text was taken. */
export function collisions(doc: Y.Doc, changes: readonly KeyChange[]): KeyChange[] {
  return changes.filter(({ root, key, before, after }) => {
    if (!isRoot(root)) return false;
    const now = rootOf(doc, root).get(key);
    return !isEqual(now, before) && !isEqual(now, after);
  });
}

/** Makes the changes as one edit, which one undo takes back. */
export function applyTextChanges(doc: Y.Doc, changes: readonly KeyChange[]): void {
  asOneEdit(doc, () => {
    for (const { root, key, after } of changes) {
      if (!isRoot(root)) continue;
      const map = rootOf(doc, root);
      if (after === undefined) map.delete(key);
      else if (!isEqual(map.get(key), after)) map.set(key, after);
    }
  });
}

/** What the keys belong to, each once, as a person calls it. */
export function places(graph: Graph, changes: readonly KeyChange[]): string[] {
  const names = new Set<string>();
  for (const { root, key, after } of changes) names.add(placeOf(graph, root, key, after));
  return [...names];
}

function placeOf(graph: Graph, root: string, key: string, after: unknown): string {
  const { head } = splitKey(key);
  if (root === "meta") return "the graph";
  const ends = endsOf(bundleOfKey(head) ?? head);
  const name = (end: Key) => {
    if (end === ENTRY) return "Entry";
    if (end === EXIT) return "Exit";
    const action = graph.actions.find((candidate) => candidate.key === end);
    return action ? `${action.name} ${action.instanceId}` : "a new action";
  };
  if (ends) return `${name(ends.parent)} → ${name(ends.child)}`;
  if (root === "positions" && head.startsWith("g/")) return "notes";
  return root === "actions" && head === key && typeof after === "string" ? after : name(head);
}
