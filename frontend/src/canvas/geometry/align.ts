/** Aligning, distributing, and tidying a part: from where things stand to where they shall. Pure. */
import type { Graph, Key, Position } from "../../graph/model";
import { arrange, type Positions, type Sizes } from "./arrange";

export interface Block {
  readonly key: Key;
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

export type Align = "left" | "center" | "right" | "top" | "middle" | "bottom";

const right = (block: Block) => block.x + block.width;
const bottom = (block: Block) => block.y + block.height;

export function align(blocks: readonly Block[], how: Align): Positions {
  const left = Math.min(...blocks.map(({ x }) => x));
  const top = Math.min(...blocks.map(({ y }) => y));
  const far = Math.max(...blocks.map(right));
  const low = Math.max(...blocks.map(bottom));
  const at = (block: Block): Position => {
    const { x, y, width, height } = block;
    switch (how) {
      case "left":
        return [left, y];
      case "center":
        return [Math.round((left + far - width) / 2), y];
      case "right":
        return [far - width, y];
      case "top":
        return [x, top];
      case "middle":
        return [x, Math.round((top + low - height) / 2)];
      case "bottom":
        return [x, low - height];
    }
  };
  return new Map(blocks.map((block) => [block.key, at(block)]));
}

/** Equal gaps between neighbours; the outermost stay. */
export function distribute(blocks: readonly Block[], axis: "x" | "y"): Positions {
  const size = (block: Block) => (axis === "x" ? block.width : block.height);
  const middle = (block: Block) => block[axis] + size(block) / 2;
  const sorted = [...blocks].sort((a, b) => middle(a) - middle(b) || (a.key < b.key ? -1 : 1));
  const [first, last] = [sorted[0], sorted.at(-1)];
  if (!first || !last || sorted.length < 3) return new Map();
  const inner = sorted.slice(1, -1).reduce((sum, block) => sum + size(block), 0);
  const gap = (last[axis] - first[axis] - size(first) - inner) / (sorted.length - 1);
  const places: Positions = new Map();
  let next = first[axis];
  for (const block of sorted) {
    const at = block === last ? last[axis] : Math.round(next);
    places.set(block.key, axis === "x" ? [at, block.y] : [block.x, at]);
    next += size(block) + gap;
  }
  return places;
}

/** Fresh places for a part of the graph; its upper left corner stays where it is. */
export function tidied(
  graph: Graph,
  keys: ReadonlySet<Key>,
  places: ReadonlyMap<Key, Position>,
  sizes: Sizes,
): Positions {
  const part: Graph = {
    ...graph,
    actions: graph.actions.filter(({ key }) => keys.has(key)),
    relations: graph.relations.filter(({ parent, child }) => keys.has(parent) && keys.has(child)),
  };
  const fresh = arrange(part, sizes);
  const corner = (all: ReadonlyMap<Key, Position>): Position => {
    const known = [...keys].flatMap((key) => {
      const at = all.get(key);
      return at ? [at] : [];
    });
    return [Math.min(...known.map(([x]) => x)), Math.min(...known.map(([, y]) => y))];
  };
  const [old, now] = [corner(places), corner(fresh)];
  return new Map(
    [...keys].flatMap((key): [Key, Position][] => {
      const at = fresh.get(key);
      return at ? [[key, [at[0] - now[0] + old[0], at[1] - now[1] + old[1]]]] : [];
    }),
  );
}
