/**
 * Computes the places at which arrows start and end on cards and on the entry and exit, without
 * rendering them.
 */
import { type NodeHandle, Position as Side } from "@xyflow/react";
import { type Action, type Direction, ENTRY, type EXIT, type Key } from "../graph/model";
import { cardSize } from "./geometry/arrange";
import { pillSize } from "./geometry/ranks";
import { OUTCOMES } from "./outcome";

type Extent = Readonly<{ width: number; height: number }>;

const INPUT = 13; // px across
const OUTCOME = 20;
const APART = 22; // px between outcomes, from left to right
const BORDER = 1; // px, as browsers draw it
const FIRST = 0.14; // of the lower edge's width, top down
const NEXT = 0.24;

const around = (x: number, y: number, size: number) => ({
  ...{ x: x - size / 2, y: y - size / 2 },
  ...{ width: size, height: size },
});

function cardHandles({ width, height }: Extent, direction: Direction): NodeHandle[] {
  const right = direction === "right";
  const inner = width - 2 * BORDER;
  return [
    {
      ...{ id: "in", type: "target", position: right ? Side.Left : Side.Top },
      ...around(right ? 0 : width / 2, right ? height / 2 : 0, INPUT),
    },
    ...OUTCOMES.map((id, i): NodeHandle => {
      const x = right ? width : BORDER + inner * (FIRST + NEXT * i);
      const y = right ? height / 2 + (i - 1.5) * APART : height;
      const position = right ? Side.Right : Side.Bottom;
      return { id, type: "source", position, ...around(x, y, OUTCOME) };
    }),
  ];
}

function endHandles(key: Key, { width, height }: Extent, direction: Direction): NodeHandle[] {
  const right = direction === "right";
  if (key === ENTRY) {
    const [x, y] = right ? [width - BORDER, height / 2] : [width / 2, height - BORDER];
    const position = right ? Side.Right : Side.Bottom;
    return [{ id: "start", type: "source", position, ...around(x, y, INPUT) }];
  }
  const [x, y] = right ? [BORDER, height / 2] : [width / 2, BORDER];
  const position = right ? Side.Left : Side.Top;
  return [{ id: "in", type: "target", position, ...around(x, y, INPUT) }];
}

interface Known {
  readonly measured: Extent;
  readonly handles: NodeHandle[];
}

/**
 * Sizes and handles by direction and size; equal requests get the identical object, so that React
 * renders nothing again.
 */
const known = new Map<string, Known>();

function remembered(name: string, make: () => Known): Known {
  const found = known.get(name) ?? make();
  known.set(name, found);
  return found;
}

/** Return the size and the handles of a card that is not rendered; cards out of sight never are. */
export function expectedCard(
  action: Pick<Action, "inputs">,
  direction: Direction,
  measured: Extent = cardSize(action, direction),
): Known {
  return remembered(`${direction} ${measured.width} ${measured.height}`, () => ({
    measured,
    handles: cardHandles(measured, direction),
  }));
}

/** Return the size and the handle of the entry or exit. */
export function expectedEnd(key: typeof ENTRY | typeof EXIT, direction: Direction): Known {
  return remembered(`${direction} ${key}`, () => {
    const measured = pillSize(direction);
    return { measured, handles: endHandles(key, measured, direction) };
  });
}
