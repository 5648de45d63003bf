/** What lies under a point of the screen. */
import type { Position } from "../../graph/model";

type Pointed = { clientX: number; clientY: number } | { changedTouches: TouchList };

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

/** The key of the card, end or note under a point. */
export function nodeAt(at: Position): string | null {
  const [hit] = hits(at);
  return hit?.closest<HTMLElement>(".react-flow__node")?.dataset.id ?? null;
}

const REACH = 14; // px round the point: an arrow is thin, a dropped card is not

/** The id of the relation whose arrow or label lies at a point, also below a card. */
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
