/**
 * Turns points of lines into SVG paths with round corners, and adapts routed lines to ends that
 * have moved. Pure.
 */
import { LINK } from "./docks";
import type { Point } from "./scene";
import type { RoutedLine } from "./simple-lines";

const RADIUS = 10; // px

/** Return points as an SVG path whose corners have the radius where there is room. */
export function pathOf(points: readonly Point[], radius = RADIUS): string {
  const parts: string[] = [];
  for (const [i, point] of points.entries()) {
    const [before, after] = [points[i - 1], points[i + 1]];
    if (!before) parts.push(`M${point.join(" ")}`);
    else if (!after) parts.push(`L${point.join(" ")}`);
    else {
      const r = Math.min(radius, distance(before, point) / 2, distance(point, after) / 2);
      const [into, out] = [towards(point, before, r), towards(point, after, r)];
      parts.push(`L${into.join(" ")}Q${point.join(" ")} ${out.join(" ")}`);
    }
  }
  return parts.join("");
}

const distance = (a: Point, b: Point) => Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1]);

function towards([x, y]: Point, [toX, toY]: Point, by: number): Point {
  return [x + Math.sign(toX - x) * by, y + Math.sign(toY - y) * by];
}

/** Return the points of a line behind its pill, which stands beside the card that the line leaves. */
export function behindPill({ points: [first, second, ...rest] }: RoutedLine): Point[] {
  const linked = first !== undefined && second !== undefined && distance(first, second) <= LINK;
  return linked ? rest.slice(1) : second ? [second, ...rest] : [];
}

/**
 * Return a routed line with its current ends, which `simple` has. If only its ends have moved a
 * little, its first and last pieces are stretched until it is routed again; the simple line
 * replaces it where stretching would turn it back.
 */
export function lineNow(known: RoutedLine | undefined, simple: RoutedLine): RoutedLine {
  if (!known || known.direction !== simple.direction) return simple;
  const [old, now] = [known.points, simple.points];
  const [first, last] = [now[0], now.at(-1)];
  const [start, end] = [old[0], old.at(-1)];
  if (!first || !last || !start || !end) return simple;
  const same = known.docked === simple.docked ? known.pill : simple.pill;
  const pill = simple.docked ? simple.pill : same;
  if (equal(first, start) && equal(last, end) && known.ends === simple.ends)
    return known.pill === pill || (known.pill && pill && equal(known.pill, pill))
      ? known
      : { ...known, pill };
  const points = stretched(old, first, last, known.direction === "right" ? 0 : 1);
  const lean = pill === known.pill && known.lean === true;
  const { ends, docked, waypoints } = simple;
  return points ? { ...known, ends, points, pill, docked, lean, waypoints } : simple;
}

const equal = (a: Point, b: Point) => a[0] === b[0] && a[1] === b[1];

/** px; room for a pill and a corner. A line that turns earlier is not stretched. */
const LEAST = 40;

function stretched(points: readonly Point[], first: Point, last: Point, along: 0 | 1) {
  const across = along === 0 ? 1 : 0;
  const [turn, back] = [points[1], points.at(-2)];
  if (!turn || !back) return null;
  if (points.length === 2) return first[across] === last[across] ? [first, last] : null;
  if (turn[along] < first[along] + LEAST || back[along] > last[along] - 8) return null;
  const at = (u: number, v: number): Point => (along === 0 ? [u, v] : [v, u]);
  return points.map((point, i) => {
    if (i === 0) return first;
    if (i === points.length - 1) return last;
    if (i === 1) return at(point[along], first[across]);
    return i === points.length - 2 ? at(point[along], last[across]) : point;
  });
}
