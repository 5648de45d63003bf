/** Edits of what reaches an input: from which output, and under which name. */
import type * as Y from "yjs";
import { flatName, relationId } from "../document-keys";
import type { Key } from "../model";
import { remapFor, type Tie } from "../parameters/output-choices";
import { asOneEdit, graphNow } from "./document-writes";
import { setRemap } from "./relations";

function arrowOf(doc: Y.Doc, id: string) {
  return graphNow(doc).relations.find((relation) => relationId(relation) === id);
}

/** Brings outputs along an arrow to inputs, renamed where the names differ, as one edit. */
export function takeOutputs(doc: Y.Doc, id: string, ties: readonly Tie[]): boolean {
  const relation = arrowOf(doc, id);
  if (relation === undefined) return false;
  const next = remapFor(relation.remap, ties);
  const kept = new Map(next.map(({ source, target }) => [source, target]));
  return asOneEdit(doc, () => {
    for (const { source, target } of relation.remap) {
      if (kept.get(source) !== target) setRemap(doc, id, source, null);
    }
    const known = new Map(relation.remap.map(({ source, target }) => [source, target]));
    for (const [source, target] of kept) {
      if (known.get(source) !== target) setRemap(doc, id, source, target);
    }
    return true;
  });
}

/** Takes away the renamings that bring outputs to inputs of an action. False when there are none. */
export function leaveOutputs(doc: Y.Doc, key: Key, paths: readonly string[]): boolean {
  const names = new Set(paths.map(flatName));
  const found = graphNow(doc).relations.flatMap((relation) =>
    relation.child !== key
      ? []
      : relation.remap
          .filter(({ target }) => names.has(target))
          .map(({ source }) => ({ id: relationId(relation), source })),
  );
  if (found.length === 0) return false;
  asOneEdit(doc, () => {
    for (const { id, source } of found) setRemap(doc, id, source, null);
  });
  return true;
}
