/** Finds the way of one line over the grid of a scene, also through waypoints: A* with costs for turns, crossings and shared pieces. */
import { BLOCKED, NEAR, type Raster, TIGHT } from "./raster";
import type { GridPoint } from "./scene";

/** Costs, in steps of the grid. */
const PRICE = { turn: 3, crossing: 3, near: 0.5, tight: 8, touch: 60, shared: 240 } as const;
/** A line keeps its simple way if the search has visited this many points without success. */
const MOST_STEPS = 400_000;

/** One piece of a line that leads through waypoints. */
interface Leg {
  /** The direction in which it starts. */
  readonly way: number;
  /** True if it starts at a waypoint, where the line may turn although the waypoint lies on the line itself. */
  readonly inner: boolean;
  /** The next goal if the piece ends at a waypoint; null: it ends along the direction of the graph. */
  readonly next: { readonly cell: number; readonly last: boolean } | null;
}

/**
 * Directions: 0 along the direction of the graph, 1 across, 2 back, 3 across the other way; `^ 2`
 * is the opposite one.
 */
const ALONG = 0;
const WHOLE: Leg = { way: ALONG, inner: false, next: null };

/** Finds ways over one raster; its arrays are used again for each search. */
export class Router {
  readonly raster: Raster;
  private readonly price: Float32Array;
  private readonly before: Int32Array;
  /**
   * The number of the search that last visited a state, so that arrays need not be cleared between
   * searches.
   */
  private readonly seen: Int32Array;
  private readonly closed: Int32Array;
  private search = 0;
  private readonly heap = new Heap();

  constructor(raster: Raster) {
    this.raster = raster;
    const states = raster.ground.length * 4 + 1; // the last state stands for a waypoint that is reached
    this.price = new Float32Array(states);
    this.before = new Int32Array(states);
    this.seen = new Int32Array(states);
    this.closed = new Int32Array(states);
  }

  /**
   * Return the corners of the cheapest way; null if there is none. A whole line starts and ends
   * along the direction of the graph.
   */
  route(start: number, end: number, leg: Leg = WHOLE): number[] | null {
    const { ground } = this.raster;
    if (start < 0 || end < 0) return null;
    this.search += 1;
    this.heap.clear();
    const reached = ground.length * 4;
    this.see(start * 4 + leg.way, 0, -1, 0);
    for (let left = MOST_STEPS; left > 0; left -= 1) {
      const state = this.heap.pop();
      if (state < 0) return null;
      if (this.closed[state] === this.search) continue;
      this.closed[state] = this.search;
      if (state === reached) return this.corners(this.before[state] ?? -1);
      const cell = state >> 2;
      const way = state & 3;
      if (cell === end && way === ALONG && leg.next === null) return this.corners(state);
      const paid = this.price[state] ?? 0;
      if (cell === end && leg.next !== null) {
        this.see(reached, paid + PRICE.turn * this.turnsOn(cell, way, leg.next), state, 0);
        continue;
      }
      for (let next = 0; next < 4; next += 1) {
        if ((next ^ 2) === way) continue;
        if (cell === end && next === ALONG) {
          // The last turn, into the straight piece before the card.
          this.see(cell * 4 + ALONG, paid + this.passing(cell, way, ALONG), state, 0);
          continue;
        }
        const to = this.beside(cell, next, end);
        if (to < 0) continue;
        const stands = ground[to] ?? 0;
        const here =
          cell === start ? this.leaving(cell, [way, next], leg) : this.passing(cell, way, next);
        const step = 1 + (stands === TIGHT ? PRICE.tight : stands === NEAR ? PRICE.near : 0);
        const least = this.leastFrom(to, next, end, leg);
        this.see(to * 4 + next, paid + here + step + this.sharing(cell, to, next), state, least);
      }
    }
    return null;
  }

  /** Return the next point in a direction; -1 at the edge of the raster, and where the point is blocked. */
  private beside(cell: number, next: number, end: number): number {
    const { ground, width } = this.raster;
    const x = cell % width;
    if ((next === 0 && x === width - 1) || (next === 2 && x === 0)) return -1;
    if ((next === 1 && cell >= ground.length - width) || (next === 3 && cell < width)) return -1;
    const to = cell + (next === 0 ? 1 : next === 2 ? -1 : next === 1 ? width : -width);
    return ground[to] === BLOCKED && to !== end ? -1 : to;
  }

  private see(state: number, price: number, before: number, least: number): void {
    if (this.closed[state] === this.search) return;
    if (this.seen[state] === this.search && price >= (this.price[state] ?? 0)) return;
    this.seen[state] = this.search;
    this.price[state] = price;
    this.before[state] = before;
    this.heap.push(state, price + least);
  }

  /** Return a lower bound for the remaining cost (the heuristic of A*). */
  private leastFrom(cell: number, way: number, end: number, { next }: Leg): number {
    const { width } = this.raster;
    const dx = (end % width) - (cell % width);
    const dy = Math.floor(end / width) - Math.floor(cell / width);
    const turns = next === null ? leastTurns(way, dx, dy) : 0;
    return Math.abs(dx) + Math.abs(dy) + PRICE.turn * turns;
  }

  /** Return the least number of turns of the next piece after arriving in this direction. */
  private turnsOn(cell: number, way: number, next: NonNullable<Leg["next"]>): number {
    const { width } = this.raster;
    const dx = (next.cell % width) - (cell % width);
    const dy = Math.floor(next.cell / width) - Math.floor(cell / width);
    return next.last ? leastTurns(way, dx, dy) : turnsTowards(way, dx, dy);
  }

  private leaving(cell: number, [way, next]: readonly [number, number], { inner }: Leg): number {
    if (way === next) return 0;
    return inner ? PRICE.turn : this.passing(cell, way, next);
  }

  /** Return the cost of passing a point: a turn, a crossing, or touching another line. */
  private passing(cell: number, way: number, next: number): number {
    const { turns, along, across, width } = this.raster;
    const touched = (turns[cell] ?? 0) > 0;
    if (way !== next) {
      return PRICE.turn + (touched || this.raster.isUsed(cell) ? PRICE.touch : 0);
    }
    if (touched) return PRICE.touch;
    const crossed = way & 1 ? along[cell] || along[cell - 1] : across[cell] || across[cell - width];
    return crossed ? PRICE.crossing : 0;
  }

  private sharing(from: number, to: number, way: number): number {
    const layer = way & 1 ? this.raster.across : this.raster.along;
    return layer[Math.min(from, to)] ? PRICE.shared : 0;
  }

  private corners(state: number): number[] {
    const cells: number[] = [];
    for (let at = state; at >= 0; at = this.before[at] ?? -1) cells.push(at >> 2);
    return straightened(cells.reverse(), this.raster.width);
  }
}

/** Return the least number of turns to arrive along the direction of the graph. */
function leastTurns(way: number, dx: number, dy: number): number {
  if (way === ALONG) return dx < 0 ? 4 : dy === 0 ? 0 : 2;
  if (way === 2) return 2;
  if (dx < 0) return 3;
  return dy === 0 || (way === 1) === dy > 0 ? 1 : 3;
}

/** Return the least number of turns to reach a point in any direction. */
function turnsTowards(way: number, dx: number, dy: number): number {
  const [ahead, aside] = way & 1 ? [dy, dx] : [dx, dy];
  const forward = way < 2 ? ahead : -ahead;
  if (aside === 0) return forward > 0 ? 0 : 3;
  return forward >= 0 ? 1 : 2;
}

/** Return the points without those at which nothing turns. */
export function straightened(cells: number[], width: number): number[] {
  const level = (a: number, b: number) => Math.floor(a / width) === Math.floor(b / width);
  const kept: number[] = [];
  for (const cell of cells) {
    const [a, b] = [kept.at(-2), kept.at(-1)];
    if (b === cell) continue;
    if (a !== undefined && b !== undefined && level(a, b) === level(b, cell)) kept.pop();
    kept.push(cell);
  }
  return kept;
}

/** A binary heap of states; among equal costs the order depends only on the order of insertion. */
class Heap {
  private states = new Int32Array(1 << 14);
  private keys = new Float64Array(1 << 14);
  private size = 0;

  clear(): void {
    this.size = 0;
  }

  push(state: number, key: number): void {
    if (this.size === this.states.length) this.grow();
    const { states, keys } = this;
    let i = this.size;
    this.size += 1;
    while (i > 0) {
      const up = (i - 1) >> 1;
      if ((keys[up] ?? 0) <= key) break;
      keys[i] = keys[up] ?? 0;
      states[i] = states[up] ?? 0;
      i = up;
    }
    keys[i] = key;
    states[i] = state;
  }

  /** Remove and return the cheapest state; -1 if the heap is empty. */
  pop(): number {
    if (this.size === 0) return -1;
    const { states, keys } = this;
    const first = states[0] ?? -1;
    this.size -= 1;
    const [state, key] = [states[this.size] ?? 0, keys[this.size] ?? 0];
    let i = 0;
    for (;;) {
      let down = 2 * i + 1;
      if (down >= this.size) break;
      if (down + 1 < this.size && (keys[down + 1] ?? 0) < (keys[down] ?? 0)) down += 1;
      if ((keys[down] ?? 0) >= key) break;
      keys[i] = keys[down] ?? 0;
      states[i] = states[down] ?? 0;
      i = down;
    }
    keys[i] = key;
    states[i] = state;
    return first;
  }

  private grow(): void {
    const [states, keys] = [this.states, this.keys];
    this.states = new Int32Array(states.length * 2);
    this.keys = new Float64Array(keys.length * 2);
    this.states.set(states);
    this.keys.set(keys);
  }
}

/** Return the raster points of the waypoints that are free; those under a card or a pill are left out. */
export function freeCells(raster: Raster, points: readonly GridPoint[]): number[] {
  const cells = points
    .map(({ column, row }) => raster.cellAt(column, row))
    .filter((cell) => cell >= 0 && raster.ground[cell] !== BLOCKED);
  return cells.filter((cell, i) => cell !== cells[i - 1]);
}

interface LedWay {
  readonly cells: number[] | null;
  /** A waypoint that cannot be reached was left out. */
  readonly missed: boolean;
}

/** Return the corners of a way that passes these points in their order. */
export function routeThrough(
  router: Router,
  [start, end]: readonly [number, number],
  waypoints: readonly number[],
): LedWay {
  const { raster } = router;
  if (waypoints.length === 0) return { cells: router.route(start, end), missed: false };
  const legs: number[][] = [];
  let [at, way, missed] = [start, ALONG, false];
  for (const [i, cell] of [...waypoints, end].entries()) {
    if (cell === at && i < waypoints.length) continue;
    const following = [...waypoints.slice(i + 1), end][0] ?? end;
    const next =
      i < waypoints.length ? { cell: following, last: i === waypoints.length - 1 } : null;
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

/** Return the direction of the last piece of a leg; null if it has none. */
function arrival(corners: readonly number[], width: number): number | null {
  const [a, b] = [corners.at(-2), corners.at(-1)];
  if (a === undefined || b === undefined) return null;
  const level = Math.floor(a / width) === Math.floor(b / width);
  if (level) return b > a ? 0 : 2;
  return b > a ? 1 : 3;
}
