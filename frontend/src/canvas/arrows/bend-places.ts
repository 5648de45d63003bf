/** Where a line can be taken to bend it: on its waypoints, and in the middle of its longer pieces. Pure. */
import type { Point } from "./scene";
import type { RoutedLine } from "./simple-lines";

/** The middle of a piece; a waypoint that is made there has this place among the others. */
export interface PieceMiddle {
  readonly index: number;
  readonly at: Point;
}

const PILL = 24; // px of a line that its pill covers, on either side of its middle

const between = (a: Point, b: Point) => Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1]);

/** How far along a line its corners are. */
function lengthsOf(points: readonly Point[]): number[] {
  let length = 0;
  return points.map((point, i) => {
    length += i === 0 ? 0 : between(points[i - 1] ?? point, point);
    return length;
  });
}

/** How far along the line a place is, not before `from`; null where the line does not come by. */
function placeOn(
  points: readonly Point[],
  lengths: readonly number[],
  place: Point,
  from: number,
): number | null {
  for (let i = 1; i < points.length; i += 1) {
    const [a, b] = [points[i - 1] ?? place, points[i] ?? place];
    const here = (lengths[i - 1] ?? 0) + between(a, place);
    if (between(a, place) + between(place, b) === between(a, b) && here >= from) return here;
  }
  return null;
}

/** The middles of pieces between corners, waypoints and the pill that are at least so long. */
export function middlesOf({ points, via, pill }: RoutedLine, least: number): PieceMiddle[] {
  const lengths = lengthsOf(points);
  const [start] = points;
  const first = start && pill ? (placeOn(points, lengths, pill, 0) ?? -PILL) + PILL : 0;
  let passed = first;
  const stops = via.flatMap((place, i) => {
    const at = placeOn(points, lengths, place, passed);
    if (at === null) return [];
    passed = at;
    return [{ at, index: i + 1 }];
  });
  const cuts = [...new Set([first, ...lengths, ...stops.map(({ at }) => at)])]
    .filter((at) => at >= first)
    .sort((a, b) => a - b);
  const pieces = cuts.slice(1).map((end, i) => ({ begin: cuts[i] ?? end, end }));
  const longest = Math.max(...pieces.map(({ begin, end }) => end - begin));
  // A line that nobody has bent yet can be taken somewhere, however short it is.
  const enough = via.length > 0 ? least : Math.min(least, longest);
  return pieces.flatMap(({ begin, end }) => {
    if (end - begin < enough) return [];
    const index = stops.filter(({ at }) => at <= begin).at(-1)?.index ?? 0;
    return [{ index, at: pointAt(points, lengths, (begin + end) / 2) }];
  });
}

function pointAt(points: readonly Point[], lengths: readonly number[], at: number): Point {
  const i = Math.max(
    1,
    lengths.findIndex((length) => length >= at),
  );
  const [a, b] = [points[i - 1] ?? [0, 0], points[i] ?? [0, 0]];
  const [before, after] = [lengths[i - 1] ?? 0, lengths[i] ?? 0];
  const share = after === before ? 0 : (at - before) / (after - before);
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
}
