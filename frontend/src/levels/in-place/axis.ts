/** An axis of the canvas on which some stretches take more room than they have: all else keeps its order. Pure. */

/** From `from` to `to` there have to be `by` px more. */
export interface Stretch {
  readonly from: number;
  readonly to: number;
  readonly by: number;
}

export interface Axis {
  /** Where on the canvas something is drawn. */
  toView(at: number): number;
  /** Where it stands in the document: the other way round. */
  toDocument(at: number): number;
}

/** The last of ascending numbers that is no greater; -1: there is none. */
function lastUpTo(numbers: readonly number[], value: number): number {
  let [low, high] = [0, numbers.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((numbers[middle] ?? 0) <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** From ascending places to ascending places, evenly in between, and as they are on either side. */
function along(from: readonly number[], to: readonly number[]) {
  return (at: number): number => {
    const i = lastUpTo(from, at);
    const [a, b] = [from[i], from[i + 1]];
    const [start, end] = [to[i], to[i + 1]];
    if (a === undefined || start === undefined) return at;
    if (b === undefined || end === undefined) return at + start - a;
    return start + ((at - a) * (end - start)) / (b - a);
  };
}

/**
 * What stands after a stretch makes way by no more than it has to; two stretches beside each other share
 * the room. No distance ever shrinks, so that what does not overlap in the document does not here.
 */
export function axisOf(stretches: readonly Stretch[]): Axis {
  const places = [...new Set(stretches.flatMap(({ from, to }) => [from, to]))].sort(
    (a, b) => a - b,
  );
  const ending = new Map<number, Stretch[]>(places.map((place) => [place, []]));
  for (const stretch of stretches) ending.get(stretch.to)?.push(stretch);
  const moved = new Map<number, number>();
  let most = 0;
  for (const place of places) {
    for (const { from, by } of ending.get(place) ?? [])
      most = Math.max(most, (moved.get(from) ?? 0) + by);
    moved.set(place, most);
  }
  const views = places.map((place) => place + (moved.get(place) ?? 0));
  return { toView: along(places, views), toDocument: along(views, places) };
}
