/** Changes of a document that the server has worked out, key by key: what others changed meanwhile, and the edit. */
import type * as Y from "yjs";
import { isolated } from "../../words/isolated";
import {
  bundleOfKey,
  endsOf,
  ROOTS,
  type Root,
  relationId,
  rootOf,
  splitKey,
} from "../document-keys";
import type { Graph, Key } from "../model";
import { shownName } from "../questions";
import { endLabel } from "../spoken-name";
import { isEqual } from "../values";
import { asOneEdit, graphNow } from "./document-writes";

/** One key of the document; a value that is not there is `undefined`. */
export interface DocumentChange {
  readonly root: string;
  readonly key: string;
  readonly before?: unknown;
  readonly after?: unknown;
}

const isRoot = (root: string): root is Root => ROOTS.some((known) => known === root);

/** Returns the changes that would overwrite what somebody wrote since they were computed. */
export function collisions(doc: Y.Doc, changes: readonly DocumentChange[]): DocumentChange[] {
  return changes.filter(({ root, key, before, after }) => {
    if (!isRoot(root)) return false;
    const now = rootOf(doc, root).get(key);
    return !isEqual(now, before) && !isEqual(now, after);
  });
}

/** Makes the changes as one edit, which one undo takes back. */
export function applyChanges(doc: Y.Doc, changes: readonly DocumentChange[]): void {
  asOneEdit(doc, () => {
    for (const { root, key, after } of changes) {
      if (!isRoot(root)) continue;
      const map = rootOf(doc, root);
      if (after === undefined) map.delete(key);
      else if (!isEqual(map.get(key), after)) map.set(key, after);
    }
  });
}

/**
 * Like `collisions`, for changes that delete actions. Places do not count; arrows to a deleted action and fields
 * that were added to it do, unless they are deleted, too.
 */
export function collisionsOfActions(
  doc: Y.Doc,
  changes: readonly DocumentChange[],
): DocumentChange[] {
  const meant = changes.filter(({ root }) => root !== "positions");
  const known = new Set(meant.map(({ root, key }) => `${root} ${key}`));
  const gone = new Set(
    meant.flatMap(({ root, key, after }) =>
      root === "actions" && after === undefined && splitKey(key).rest === "" ? [key] : [],
    ),
  );
  const arrows = new Set(meant.flatMap(({ root, key }) => (root === "relations" ? [key] : [])));
  const heads = new Set([...arrows].map((key) => splitKey(key).head));
  const isGone = (head: string) => {
    const ends = endsOf(head);
    return ends !== null && (gone.has(ends.parent) || gone.has(ends.child));
  };
  const fresh = (root: Root, fits: (head: string) => boolean): DocumentChange[] =>
    [...rootOf(doc, root).keys()]
      .filter((key) => fits(splitKey(key).head) && !known.has(`${root} ${key}`))
      .map((key) => ({ root, key }));
  const drawn = graphNow(doc)
    .relations.map((relation) => relationId(relation))
    .filter((id) => isGone(id) && !heads.has(id))
    .map((key) => ({ root: "relations", key }));
  return [
    ...collisions(doc, meant),
    // Somebody else took it away, perhaps into a graph of its own.
    ...meant.filter(
      ({ root, key }) => root === "actions" && gone.has(key) && !rootOf(doc, "actions").has(key),
    ),
    ...fresh("actions", (head) => gone.has(head)),
    ...fresh("relations", (head) => heads.has(head) && isGone(head)),
    ...drawn,
  ];
}

/** Makes the changes as one edit; what somebody has moved meanwhile stays there. */
export function applyActionChanges(doc: Y.Doc, changes: readonly DocumentChange[]): void {
  const positions = rootOf(doc, "positions");
  const moved = ({ root, key, before, after }: DocumentChange) =>
    root === "positions" &&
    before !== undefined &&
    after !== undefined &&
    !isEqual(positions.get(key), before);
  applyChanges(
    doc,
    changes.filter((change) => !moved(change)),
  );
}

/** Returns the names of what the changes belong to, each once, as a person calls it. */
export function places(graph: Graph, changes: readonly DocumentChange[]): string[] {
  const names = new Set<string>();
  for (const change of changes) names.add(placeOf(graph, change));
  return [...names];
}

function placeOf(graph: Graph, { root, key, before, after }: DocumentChange): string {
  const { head } = splitKey(key);
  const isName = root === "actions" && head === key;
  if (root === "meta") return "the graph";
  const ends = endsOf(bundleOfKey(head) ?? head);
  const name = (end: Key) => {
    const label = endLabel(end);
    if (label !== null) return label;
    const action = graph.actions.find((candidate) => candidate.key === end);
    return action ? `${shownName(action.name)} ${action.instanceId}` : "a new action";
  };
  if (ends) return `${isolated(name(ends.parent))} → ${isolated(name(ends.child))}`;
  if (root === "positions" && head.startsWith("g/")) return "notes";
  if (isName && typeof after === "string") return after;
  const isGone = graph.actions.every((action) => action.key !== head);
  return isName && isGone && typeof before === "string" ? `${before}, which is gone` : name(head);
}
