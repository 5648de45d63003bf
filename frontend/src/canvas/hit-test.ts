/** Finds what lies at a point on the screen. */
import type { Position } from "../graph/model";

type Pointed = { clientX: number; clientY: number } | { changedTouches: TouchList };

/** Return the place of a mouse or touch event on the screen. */
export function pointOf(event: Pointed): Position {
  if ("changedTouches" in event) {
    const touch = event.changedTouches[0];
    return touch ? [touch.clientX, touch.clientY] : [0, 0];
  }
  return [event.clientX, event.clientY];
}

function hits([x, y]: Position): readonly Element[] {
  return document.elementsFromPoint(x, y);
}

/** Return the key of the topmost card, end or note at a point; null if there is none. */
export function nodeAt(at: Position): string | null {
  const [hit] = hits(at);
  return hit?.closest<HTMLElement>(".react-flow__node")?.dataset.id ?? null;
}

const REACH = 14; // px around the point, since an arrow is thin

/**
 * Return the id of the relation whose arrow or pill lies at a point, also below a card; null if
 * there is none.
 */
export function arrowAt([x, y]: Position): string | null {
  for (const [dx, dy] of [
    [0, 0],
    [REACH, 0],
    [-REACH, 0],
    [0, REACH],
    [0, -REACH],
  ] as const) {
    for (const hit of hits([x + dx, y + dy])) {
      const edge = hit.closest<HTMLElement>(".react-flow__edge")?.dataset.id;
      const id =
        edge?.split("|")[0] ?? hit.closest<HTMLElement>("[data-relation]")?.dataset.relation;
      if (id) return id;
    }
  }
  return null;
}
