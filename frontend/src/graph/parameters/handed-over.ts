/**
 * Computes which outputs of a parent reach which inputs of its child, as the engine looks for them: the twin of
 * `renamed` in `umrf/semantics/values.py` (docs/umrf-and-the-engine.md 2.7). Pure.
 *
 * The engine renames inside a sorted tree whose order is not restored, so that after a renaming other
 * outputs may not be found any more.
 */
import type { Remap } from "../model";
import { byText } from "../values";

/** The name of the output for each input that one reaches; null: the engine breaks down at it. */
export function handedOver(
  outputs: readonly string[],
  remap: readonly Remap[],
  inputs: readonly string[],
): ReadonlyMap<string, string> | null {
  const known = new Set(inputs);
  const own = [...outputs].sort(byText);
  if (remap.length === 0) return new Map(own.filter((o) => known.has(o)).map((o) => [o, o]));
  const names = [...own];
  const tree = shapeOf(own.length);
  for (const { source, target } of remap) {
    const place = find(tree, names, source);
    if (place === null) return null;
    names[place] = target;
  }
  const found = new Map<string, string>();
  for (const name of new Set(names)) {
    const place = known.has(name) ? find(tree, names, name) : null;
    const output = place === null ? undefined : own[place];
    if (output !== undefined) found.set(name, output);
  }
  return found;
}

/** The place of a name by the comparisons that the order of the tree promises. */
function find(tree: NameTree, names: readonly string[], name: string): number | null {
  let best: number | null = null;
  for (let place = tree.root; place !== null; ) {
    const left = byText(names[place] ?? "", name) < 0;
    if (!left) best = place;
    place = (left ? tree.right[place] : tree.left[place]) ?? null;
  }
  return best !== null && byText(name, names[best] ?? "") >= 0 ? best : null;
}

interface NameTree {
  root: number | null;
  readonly left: (number | null)[];
  readonly right: (number | null)[];
}

const shapes = new Map<number, NameTree>();

/** The tree of sorted names that were put in one by one: it depends on their number only. */
function shapeOf(count: number): NameTree {
  const known = shapes.get(count);
  if (known) return known;
  const tree = grown(count);
  if (shapes.size < 64) shapes.set(count, tree);
  return tree;
}

/** A red-black tree, each of whose members was greater than all before it, as `std::set` grows. */
function grown(count: number): NameTree {
  const none = () => new Array<number | null>(count).fill(null);
  const tree: NameTree = { root: null, left: none(), right: none() };
  const parent = none();
  const red = new Array<boolean>(count).fill(true);
  const up = (of: number) => parent[of] ?? null;
  const turnLeft = (top: number) => {
    const right = tree.right[top] ?? top;
    const [inner, above] = [tree.left[right] ?? null, up(top)];
    tree.right[top] = inner;
    if (inner !== null) parent[inner] = top;
    parent[right] = above;
    if (above === null) tree.root = right;
    else tree.right[above] = right;
    tree.left[right] = top;
    parent[top] = right;
  };
  for (let i = 0; i < count; i += 1) {
    parent[i] = i > 0 ? i - 1 : null;
    if (i > 0) tree.right[i - 1] = i;
    else tree.root = i;
    let now = i;
    for (let above = up(now); above !== null && red[above]; above = up(now)) {
      const top = up(above) ?? above;
      const uncle = tree.left[top] ?? null;
      if (uncle !== null && red[uncle]) {
        red[above] = false;
        red[uncle] = false;
        red[top] = true;
        now = top;
      } else {
        red[above] = false;
        red[top] = true;
        turnLeft(top);
      }
    }
    red[tree.root ?? 0] = false;
  }
  return tree;
}
