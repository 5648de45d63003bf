/** The way of a line that people have led through waypoints: leg by leg, by the same router. Pure. */
import { BLOCKED, type Raster } from "./raster";
import { ALONG, type Router, straightened } from "./router";
import type { GridPoint } from "./scene";

/** The waypoints that a line can visit now: on those that are left out stands a card or a pill. */
export function freeCells(raster: Raster, points: readonly GridPoint[]): number[] {
  const cells = points
    .map(({ column, row }) => raster.cellAt(column, row))
    .filter((cell) => cell >= 0 && raster.ground[cell] !== BLOCKED);
  return cells.filter((cell, i) => cell !== cells[i - 1]);
}

export interface LedWay {
  readonly cells: number[] | null;
  /** A waypoint to which nothing leads was left out. */
  readonly missed: boolean;
}

/** The corners of a way through cells in their order. */
export function routeThrough(
  router: Router,
  [start, end]: readonly [number, number],
  via: readonly number[],
): LedWay {
  const { raster } = router;
  if (via.length === 0) return { cells: router.route(start, end), missed: false };
  const legs: number[][] = [];
  let [at, way, missed] = [start, ALONG, false];
  for (const [i, cell] of [...via, end].entries()) {
    if (cell === at && i < via.length) continue;
    const following = [...via.slice(i + 1), end][0] ?? end;
    const next = i < via.length ? { cell: following, last: i === via.length - 1 } : null;
    const leg = router.route(at, cell, { way, inner: at !== start, next });
    if (leg === null) {
      missed = true;
      continue;
    }
    raster.mark(leg, 1); // the line keeps clear of itself, too
    legs.push(leg);
    way = arrival(leg, raster.width) ?? way;
    at = cell;
  }
  for (const leg of legs) raster.mark(leg, -1);
  if (at !== end) return { cells: router.route(start, end), missed: true };
  return { cells: straightened(legs.flat(), raster.width), missed };
}

/** The direction of the last piece of a leg. */
function arrival(corners: readonly number[], width: number): number | null {
  const [a, b] = [corners.at(-2), corners.at(-1)];
  if (a === undefined || b === undefined) return null;
  const level = Math.floor(a / width) === Math.floor(b / width);
  if (level) return b > a ? 0 : 2;
  return b > a ? 1 : 3;
}
