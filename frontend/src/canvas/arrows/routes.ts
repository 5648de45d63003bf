/** Routes the lines of a scene: all of them, or only those near something that has moved. Pure. */
import { type Dock, DockPlan } from "./docks";
import { BLOCKED, FREE, NEAR, Raster } from "./raster";
import { freeCells, Router, routeThrough, straightened } from "./router";
import { BoxIndex, boxOf, type FlowBox, type Point, type Scene, STEP } from "./scene";
import {
  arrival,
  canvasPoint,
  canvasPoints,
  departure,
  endsOf,
  middleOf,
  type RoutedLine,
  simpleLines,
  simplified,
  waypointsOf,
} from "./simple-lines";

/** A routed way in columns and rows of the grid, so that it outlives the raster. */
interface Way {
  readonly ends: string;
  readonly corners: readonly (readonly [column: number, row: number])[];
  /** The cost of its points that are nearer to a card than CLEARANCE wishes. */
  readonly near: number;
}

/** Ways of the previous scene by line id, so that unchanged lines need not be routed again. */
export type Ways = ReadonlyMap<string, Way>;

export interface Routed {
  readonly lines: Map<string, RoutedLine>;
  readonly ways: Ways;
  /** The number of lines that were searched, not taken from the previous scene. */
  readonly searched: number;
}

/** Route all lines of a scene. Lines of `known` stay if their ends and surroundings are unchanged. */
export function routed(scene: Scene, known: Ways = new Map()): Routed {
  const routing = new Routing(scene);
  return routing.routed(known);
}

interface Task {
  readonly dock: Dock;
  readonly ends: string;
  readonly start: number;
  readonly end: number;
  /** Raster points of the waypoints that are free. */
  readonly waypoints: readonly number[];
  /** The corners of its way; null if there is none. */
  cells: readonly number[] | null;
  /** A waypoint could not be reached and is left out; such a line is searched again each time. */
  missed: boolean;
  /** The corners together with the straight pieces at both ends. */
  whole: readonly number[];
  /** The way of the previous scene that it keeps; null if it was searched. */
  way: Way | null;
}

/** px that a pill which does not stand beside its card keeps from cards and pills, and from other lines. */
const LOOSE_GAPS: readonly (readonly [number, number])[] = [
  [6, 2],
  [3, 1],
];

/** Rounds in which lines that lie on other lines are searched again. */
const ROUNDS = 4;

class Routing {
  private readonly scene: Scene;
  private readonly plan: DockPlan;
  private readonly raster: Raster | null;
  private readonly cards: FlowBox[];
  private readonly tasks: Task[];
  private readonly groups = new Map<string, Set<Task>>();

  constructor(scene: Scene) {
    this.scene = scene;
    this.plan = new DockPlan(scene);
    this.cards = scene.cards.map((card) => boxOf(card, scene.direction));
    const pills = this.plan.docks.flatMap(({ pill, link }) => [pill, link].flatMap((b) => b ?? []));
    const waypointBoxes = scene.lines.flatMap(({ waypoints = [] }) =>
      waypoints.map(([x, y]) => boxOf({ x, y, width: 0, height: 0 }, scene.direction)),
    );
    const raster = Raster.of(this.cards, pills, scene.offset, waypointBoxes);
    this.raster = raster;
    this.tasks = this.plan.docks.map((dock) => ({
      dock,
      ends: endsOf(dock, scene),
      start: raster?.cellAt(dock.start.column, dock.start.row) ?? -1,
      end: raster?.cellAt(dock.end.column, dock.end.row) ?? -1,
      waypoints: raster ? freeCells(raster, waypointsOf(dock, scene)) : [],
      cells: null,
      missed: false,
      way: null,
      whole: [],
    }));
    for (const task of this.tasks) {
      for (const key of [`> ${task.dock.sharesStart}`, `< ${task.dock.sharesEnd}`]) {
        const group = this.groups.get(key) ?? new Set();
        this.groups.set(key, group.add(task));
      }
    }
  }

  routed(known: Ways): Routed {
    const { raster } = this;
    if (!raster) return { lines: simpleLines(this.scene), ways: new Map(), searched: 0 };
    const fresh = this.allStand(known)
      ? []
      : this.tasks.filter((task) => !this.keeps(task, known.get(task.dock.line.id)));
    const between = (start: number, end: number) =>
      Math.abs((start % raster.width) - (end % raster.width)) +
      Math.abs(Math.floor(start / raster.width) - Math.floor(end / raster.width));
    const length = ({ start, end, waypoints }: Task) =>
      [...waypoints, end].reduce((sum, to, i) => sum + between(waypoints[i - 1] ?? start, to), 0);
    // Short ones first: they have the fewest ways to choose from.
    const order = fresh
      .map((task, i) => ({ task, i, length: length(task) }))
      .sort((a, b) => a.length - b.length || a.i - b.i);
    if (order.length > 0) {
      const router = new Router(raster);
      for (const { task } of order) this.search(task, router);
      // Once more, now that all other lines are there.
      for (const { task } of order) if (!this.isStraight(task)) this.search(task, router);
      for (let round = 0; round < ROUNDS && this.part(fresh, round, router); round += 1);
    }
    return { ...this.drawn(), searched: this.tasks.filter(({ way }) => way === null).length };
  }

  /**
   * Search lines again that lie on others; from the second round on together with those of the same
   * cards. Return whether there were any.
   */
  private part(fresh: readonly Task[], round: number, router: Router): boolean {
    if (!fresh.some((task) => this.liesOnOther(task))) return false;
    const lying = this.tasks.filter((task) => this.liesOnOther(task));
    const cards = new Set(lying.flatMap(({ dock: { line } }) => [line.source, line.target]));
    const near = ({ dock: { line } }: Task) => cards.has(line.source) || cards.has(line.target);
    const others = round === 0 ? [] : this.tasks.filter((t) => !lying.includes(t) && near(t));
    const together = [...lying, ...others];
    for (const task of together) this.mark(task, -1);
    for (const task of together) task.cells = null;
    if (round % 2 === 0) together.reverse();
    for (const task of together) this.search(task, router);
    return true;
  }

  private liesOnOther(task: Task): boolean {
    const { raster } = this;
    if (!raster || task.cells === null) return false;
    const kin = this.kinOf(task);
    for (const other of kin) this.mark(other, -1);
    const found = raster.sharesStep(task.whole);
    for (const other of kin) this.mark(other, 1);
    return found;
  }

  private isStraight({ cells }: Task): boolean {
    return cells !== null && cells.length === 2;
  }

  /**
   * Take all known ways if nothing has changed, even those that lie on others for lack of room:
   * searching them again could change them although nobody moved anything.
   */
  private allStand(known: Ways): boolean {
    if (known.size !== this.tasks.length) return false;
    const found = this.tasks.map((task) => {
      const way = known.get(task.dock.line.id);
      const corners = way && this.standing(task, way);
      return way && corners ? { task, way, corners } : null;
    });
    if (found.includes(null)) return false;
    for (const each of found) if (each) this.put(each.task, each.corners, each.way);
    return true;
  }

  /** Take a known way if nothing blocks it and it lies on no other line. */
  private keeps(task: Task, way: Way | undefined): boolean {
    const corners = way && this.standing(task, way);
    if (!corners) return false;
    this.put(task, corners, way);
    if (!this.liesOnOther(task)) return true;
    this.mark(task, -1);
    task.cells = null;
    return false;
  }

  /** Return the corners of a known way if its ends are unchanged and no card has come nearer; else null. */
  private standing(task: Task, way: Way): number[] | null {
    const { raster } = this;
    if (!raster || way.ends !== this.endsNow(task)) return null;
    const corners = way.corners.map(([column, row]) => raster.cellAt(column, row));
    return corners.includes(-1) || this.nearness(corners) > way.near ? null : corners;
  }

  /** Return an identification of its ends and of the waypoints that it can visit. */
  private endsNow({ ends, waypoints }: Task): string {
    const { raster } = this;
    if (waypoints.length === 0 || !raster) return ends;
    return `${ends} by ${waypoints.map((cell) => [raster.columnOf(cell), raster.rowOf(cell)]).join(" ")}`;
  }

  /** Return how near a way is to cards; infinite if a card blocks it. */
  private nearness(corners: readonly number[]): number {
    const { raster } = this;
    if (!raster) return 0;
    let near = 0;
    for (let i = 1; i < corners.length; i += 1) {
      const [a = 0, b = 0] = [corners[i - 1], corners[i]];
      const level = Math.floor(a / raster.width) === Math.floor(b / raster.width);
      const step = level ? 1 : raster.width;
      for (let cell = Math.min(a, b); cell <= Math.max(a, b); cell += step) {
        const ground = raster.ground[cell] ?? FREE;
        if (ground === BLOCKED) return Number.POSITIVE_INFINITY;
        near += ground === FREE ? 0 : ground === NEAR ? 1 : 16;
      }
    }
    return near;
  }

  private search(task: Task, router: Router): void {
    // Lines that may lie on each other do not block each other.
    const kin = this.kinOf(task);
    for (const other of kin) this.mark(other, -1);
    task.cells = null;
    const { cells, missed } = routeThrough(router, [task.start, task.end], task.waypoints);
    task.missed = missed;
    this.put(task, cells, null);
    for (const other of kin) if (other !== task) this.mark(other, 1);
  }

  private kinOf(task: Task): Set<Task> {
    const { sharesStart, sharesEnd } = task.dock;
    const [first, last] = [this.groups.get(`> ${sharesStart}`), this.groups.get(`< ${sharesEnd}`)];
    return new Set([...(first ?? []), ...(last ?? [])]);
  }

  private put(task: Task, cells: readonly number[] | null, way: Way | null): void {
    task.cells = cells;
    task.way = way;
    task.whole = this.wholeOf(task);
    this.mark(task, 1);
  }

  private mark(task: Task, by: 1 | -1): void {
    if (task.cells !== null) this.raster?.mark(task.whole, by);
  }

  /** Return the corners of a way with the straight pieces after its pill or card and before the next card. */
  private wholeOf({ cells, dock }: Task): number[] {
    const { raster } = this;
    if (!raster || cells === null) return [];
    const { start, end, to, from, pill } = dock;
    const back = start.column - Math.floor((pill?.u1 ?? from.u) / STEP);
    const side = raster.cellAt(Math.floor(to.u / STEP), end.row);
    const all = [(cells[0] ?? 0) - back, ...cells];
    return straightened(side < 0 ? all : [...all, side], raster.width);
  }

  private drawn(): { lines: Map<string, RoutedLine>; ways: Ways } {
    const { raster, plan, scene } = this;
    const lines = new Map<string, RoutedLine>();
    const ways = new Map<string, Way>();
    if (!raster) return { lines, ways };
    const simple = this.tasks.some(({ cells }) => cells === null) ? simpleLines(scene) : null;
    const loose: { task: Task; points: readonly Point[] }[] = [];
    for (const task of this.tasks) {
      const { dock, ends, cells } = task;
      const { id } = dock.line;
      const plain = cells === null ? simple?.get(id) : undefined;
      if (plain) lines.set(id, plain);
      if (cells === null) continue;
      const corners = cells.map((cell) => [raster.columnOf(cell), raster.rowOf(cell)] as const);
      const near = task.way?.near ?? this.nearness(cells);
      if (!task.missed) ways.set(id, task.way ?? { ends: this.endsNow(task), corners, near });
      const points = simplified([
        ...departure(dock, plan, scene.direction),
        ...corners.map(([column, row]) => canvasPoint(plan, scene.direction, column, row)),
        arrival(dock, scene.direction),
      ]);
      const docked = dock.pill !== null;
      const pill = dock.pill && middleOf(dock.pill, scene.direction);
      const waypoints = canvasPoints(waypointsOf(dock, scene), plan, scene);
      const { direction } = scene;
      lines.set(id, { id, direction, ends, points, pill, docked, waypoints, simple: false });
      if (!docked && dock.line.pill) loose.push({ task, points });
    }
    this.placeLoose(loose, lines, raster);
    return { lines, ways };
  }

  /** Place pills that had no room beside their cards on the first free piece of their lines. */
  private placeLoose(
    loose: readonly { task: Task; points: readonly Point[] }[],
    lines: Map<string, RoutedLine>,
    raster: Raster,
  ): void {
    if (loose.length === 0) return;
    const taken = new BoxIndex<FlowBox>();
    for (const card of this.cards) taken.add(card);
    for (const { pill } of this.plan.docks) if (pill) taken.add(pill);
    for (const { task, points } of loose) {
      const line = lines.get(task.dock.line.id);
      const whole = task.dock.line.pill;
      if (!line || !whole) continue;
      this.mark(task, -1);
      const { lean = whole.width } = whole;
      const sizes = lean === whole.width ? [whole] : [whole, { ...whole, width: lean }];
      const tries = sizes.flatMap((size) => LOOSE_GAPS.map((gaps) => [size, gaps] as const));
      for (const [size, [cards, others]] of tries) {
        const boxAt = ([x, y]: Point) =>
          boxOf({ x: x - size.width / 2, y: y - size.height / 2, ...size }, this.scene.direction);
        const pill = [...places(points)].find(
          (at) => !taken.hits(boxAt(at), cards) && !raster.hasLine(boxAt(at), others),
        );
        if (!pill) continue;
        taken.add(boxAt(pill));
        lines.set(line.id, { ...line, pill, lean: size !== whole });
        break;
      }
      this.mark(task, 1);
    }
  }
}

/** Yield the points of a line at which a pill may stand, from its start. */
function* places(points: readonly Point[]): Generator<Point> {
  for (let i = 1; i < points.length; i += 1) {
    const [a, b] = [points[i - 1], points[i]];
    if (!a || !b) continue;
    const length = Math.abs(b[0] - a[0]) + Math.abs(b[1] - a[1]);
    const steps = Math.max(2, Math.floor(length / STEP));
    for (let step = 1; step < steps; step += 1) {
      const share = step / steps;
      yield [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
    }
  }
}
