/** Free places for the copies that dialogs draw, and the message if there are none. */
import { notifications } from "@mantine/notifications";
import { type Box, freeSpot, placeAfter } from "../../canvas/geometry/arrange";
import { CARD, GAP } from "../../canvas/geometry/ranks";
import { type EditorContext, takenBoxes } from "../../edit-actions/editor-context";
import type { Key, Position } from "../../graph/model";

/** Returns the box round these actions; null when none of them has a place. */
function boxRound(context: EditorContext, keys: ReadonlySet<Key>): Box | null {
  const [places, sizes] = [context.positions(), context.sizes()];
  const boxes = [...keys].flatMap((key) => {
    const at = places.get(key);
    return at ? [{ x: at[0], y: at[1], ...(sizes.get(key) ?? CARD) }] : [];
  });
  if (boxes.length === 0) return null;
  const x = Math.min(...boxes.map((box) => box.x));
  const y = Math.min(...boxes.map((box) => box.y));
  const width = Math.max(...boxes.map((box) => box.x + box.width)) - x;
  const height = Math.max(...boxes.map((box) => box.y + box.height)) - y;
  return { x, y, width, height };
}

/**
 * Returns by how much each of `count` copies is moved so that it lies on nothing: one after another
 * in the direction of the graph, or across it.
 */
export function freeShifts(
  context: EditorContext,
  keys: ReadonlySet<Key>,
  count: number,
  way: "along" | "across",
): readonly Position[] {
  const box = boxRound(context, keys);
  if (box === null) return [];
  const { direction } = context.graph;
  const taken: Box[] = takenBoxes(context);
  let before = box;
  return Array.from({ length: count }, () => {
    const goal = way === "along" ? placeAfter(before, direction) : placeBeside(before, direction);
    const [x, y] = freeSpot(goal, box, taken, direction);
    before = { ...box, x, y };
    taken.push(before);
    return [x - box.x, y - box.y] as const;
  });
}

/** Says that none was drawn: others have changed or removed the actions since the dialog was read. */
export function sayNothingDrawn(): void {
  notifications.show({ message: "Nothing was drawn: the graph has changed. Look at it again." });
}

const placeBeside = ({ x, y, width, height }: Box, direction: string): Position =>
  direction === "right" ? [x, y + height + GAP.across] : [x + width + GAP.across, y];
