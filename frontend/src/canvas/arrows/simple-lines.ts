/**
 * Simple lines, which depend only on their own ends and waypoints, and the pieces that simple and
 * routed lines share. Pure.
 */
import type { Direction } from "../../graph/model";
import { type Dock, DockPlan, LINK } from "./docks";
import {
  type FlowBox,
  type GridPoint,
  gridPoint,
  type Point,
  pointOf,
  type Scene,
  STEP,
} from "./scene";

/** A line as it is drawn. */
export interface RoutedLine {
  readonly id: string;
  readonly direction: Direction;
  /** Identifies the ends between which it was routed: while they stay the same, so may the line. */
  readonly ends: string;
  /** The corners of the line, from the side of one card to the side of the other. */
  readonly points: readonly Point[];
  /** The middle of its pill; null if it has none or there is no room. */
  readonly pill: Point | null;
  /** The pill stands beside the card that the line leaves, and can move away from it a little. */
  readonly docked: boolean;
  /** The pill has room for outcomes and response only. */
  readonly lean?: boolean;
  /** Its waypoints on the grid; the line leaves out those that are blocked. */
  readonly waypoints: readonly Point[];
  /** True if the line was not routed, because its cards stand too close or too far apart. */
  readonly simple: boolean;
}

export type LineMap = ReadonlyMap<string, RoutedLine>;

/** Return a text that identifies the ends and waypoints of a line, and the grid of its scene. */
export function endsOf({ start, end, line }: Dock, scene: Scene): string {
  const from = `${start.column},${start.row}`;
  const waypoints = (line.waypoints ?? []).map((point) => ` ${point}`).join("");
  return `${scene.direction} ${scene.offset} ${from} ${end.column},${end.row}${waypoints}`;
}

/** Return the waypoints of a line on the grid. */
export const waypointsOf = ({ line }: Dock, scene: Scene): GridPoint[] =>
  (line.waypoints ?? []).map((point) => gridPoint(point, scene));

/** Return the canvas points of points of the grid. */
export const canvasPoints = (points: readonly GridPoint[], plan: DockPlan, scene: Scene): Point[] =>
  points.map(({ column, row }) => canvasPoint(plan, scene.direction, column, row));

/**
 * Return a line for each dock that ignores what lies between its ends; they are drawn until the
 * routed ones are there.
 */
export function simpleLines(scene: Scene): Map<string, RoutedLine> {
  const plan = new DockPlan(scene);
  return new Map(
    plan.docks.map((dock) => {
      const waypoints = waypointsOf(dock, scene);
      const way = waypoints.length > 0 ? simplyThrough(dock, waypoints) : simpleWay(dock);
      const points = [...way].map(([column, row]) =>
        canvasPoint(plan, scene.direction, column, row),
      );
      const ends = endsOf(dock, scene);
      const docked = dock.pill !== null;
      const pill = dock.pill ? middleOf(dock.pill, scene.direction) : null;
      const whole = [
        ...departure(dock, plan, scene.direction),
        ...points,
        arrival(dock, scene.direction),
      ];
      const { id } = dock.line;
      return [
        id,
        {
          id,
          direction: scene.direction,
          ends,
          points: simplified(whole),
          pill,
          docked,
          waypoints: canvasPoints(waypoints, plan, scene),
          simple: true,
        },
      ];
    }),
  );
}

function* simpleWay({ start, end }: Dock): Generator<readonly [number, number]> {
  yield [start.column, start.row];
  if (start.column <= end.column) {
    yield [start.column, end.row];
  } else {
    // Back in a lane beside both cards.
    const lane = Math.max(start.row, end.row) + 6;
    yield [start.column, lane];
    yield [end.column, lane];
  }
  yield [end.column, end.row];
}

/** Yield a way with one turn between waypoints; it arrives from before the card where it can. */
function* simplyThrough(
  { start, end }: Dock,
  waypoints: readonly GridPoint[],
): Generator<readonly [number, number]> {
  let last: GridPoint = start;
  yield [start.column, start.row];
  for (const point of [...waypoints, end]) {
    const along = point !== end || last.column <= end.column;
    yield along && last !== start ? [last.column, point.row] : [point.column, last.row];
    yield [point.column, point.row];
    last = point;
  }
}

/** Return the canvas point of a column and row of the grid. */
export const canvasPoint = (plan: DockPlan, direction: Direction, column: number, row: number) =>
  pointOf(column * STEP, plan.v(row), direction);

/** Return the canvas point in the middle of a box. */
export function middleOf({ u0, u1, v0, v1 }: FlowBox, direction: Direction): Point {
  return pointOf((u0 + u1) / 2, (v0 + v1) / 2, direction);
}

/** Return the first points of a line, from the side of its card to the row of its pill. */
export function departure({ from, start }: Dock, plan: DockPlan, direction: Direction): Point[] {
  const v = plan.v(start.row);
  const first = pointOf(from.u, from.v, direction);
  // A pill beyond the corner of its card: the line leads along the card to it.
  return from.v === v
    ? [first]
    : [first, pointOf(from.u + LINK, from.v, direction), pointOf(from.u + LINK, v, direction)];
}

/** Return the last point of a line, at the side of the card that it enters. */
export const arrival = ({ to }: Dock, direction: Direction): Point =>
  pointOf(to.u, to.v, direction);

/** Return the points without those at which nothing turns. */
export function simplified(points: readonly Point[]): Point[] {
  const kept: Point[] = [];
  for (const point of points) {
    const [a, b] = [kept.at(-2), kept.at(-1)];
    if (b && b[0] === point[0] && b[1] === point[1]) continue;
    const through =
      a && b && ((a[0] === b[0] && b[0] === point[0]) || (a[1] === b[1] && b[1] === point[1]));
    if (through) kept.pop();
    kept.push(point);
  }
  return kept;
}
