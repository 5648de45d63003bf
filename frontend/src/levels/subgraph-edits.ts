/** A sub-graph that is made or unpacked, as one edit of the open graph. */
import { unplaced } from "../canvas/geometry/arrange";
import type { EditorContext } from "../edit-actions/editor-context";
import { rootOf, splitKey } from "../graph/document-keys";
import { asOneEdit, moveActions } from "../graph/edit";
import { applyActionChanges, type DocumentChange } from "../graph/edit/key-changes";
import type { Key, Position } from "../graph/model";

/** Keys of actions that come or go with these changes. */
function actionsOf(changes: readonly DocumentChange[], fits: (change: DocumentChange) => boolean) {
  const own = changes.filter(({ root, key }) => root === "actions" && splitKey(key).rest === "");
  return own.filter(fits).map(({ key }) => key);
}

const within = (place: Position | undefined) => (place === undefined ? [] : [place]);

function middleOf(places: readonly Position[]): Position | null {
  if (places.length === 0) return null;
  const [xs, ys] = [places.map(([x]) => x), places.map(([, y]) => y)];
  const mean = (all: number[]) => Math.round((Math.min(...all) + Math.max(...all)) / 2);
  return [mean(xs), mean(ys)];
}

/** Makes the changes, which one undo takes back, and shows what is new. Everything else stays where it is
 * drawn. */
export function makeActionEdit(context: EditorContext, changes: readonly DocumentChange[]): void {
  const { doc, graph } = context;
  const places = context.positions();
  const gone = new Set<Key>(actionsOf(changes, ({ after }) => after === undefined));
  const fresh = actionsOf(changes, ({ before }) => before === undefined);
  const middle = middleOf([...gone].flatMap((key) => within(places.get(key))));
  asOneEdit(doc, () => {
    moveActions(
      doc,
      unplaced(graph, places).filter(([key]) => !gone.has(key)),
    );
    applyActionChanges(doc, changes);
    const positions = rootOf(doc, "positions");
    for (const key of fresh) if (middle && !positions.has(key)) positions.set(key, [...middle]);
  });
  context.select(fresh);
  requestAnimationFrame(() => context.view.show(fresh));
}

/** A name for a graph of these actions that is nobody's yet, and that a class could have. */
export function subGraphName(first: string, taken: ReadonlySet<string>): string {
  const stem = `${first.replace(/\W/g, "").replace(/^\d+/, "") || "New"}Steps`;
  for (let n = 1; ; n += 1) {
    const name = n === 1 ? stem : `${stem}${n}`;
    if (!taken.has(name)) return name;
  }
}
