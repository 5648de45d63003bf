/** Computes the places of aligned and distributed cards. Pure. */
import type { Key, Position } from "../../graph/model";
import type { Positions } from "./ranks";

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

/** Return the places of blocks that share an edge or a middle, which the outermost block sets. */
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

/** Return places with equal gaps between neighbours; the outermost cards stay. */
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
