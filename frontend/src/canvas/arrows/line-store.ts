/** The lines of one canvas: simple ones at once, routed ones when a worker has computed them. */

import { createContext, useCallback, useContext, useSyncExternalStore } from "react";
import { onFirstView } from "../../clock/first-view";
import { tick } from "../../clock/server-clock";
import type { Position, Precondition } from "../../graph/model";
import type { Bundle } from "./bundles";
import { lineNow } from "./line-path";
import type { RouterReport } from "./router.worker";
import { type Point, type Scene, STEP } from "./scene";
import { type RoutedLine, simpleLines } from "./simple-lines";

/**
 * Limits for large graphs: with more lines than MANY, lines are updated after the cards and take only this share of the
 * time: else twenty people who move cards of a large graph would delay every frame.
 */
const MANY = 300;
const SHARE = 0.2;

/** Arrows subscribe to their own line, so that a card that moves renders only its own arrows again. */
export class LineStore {
  private readonly listeners = new Map<string, Set<() => void>>();
  private readonly routed = new Map<string, RoutedLine>();
  private simple: ReadonlyMap<string, RoutedLine> = new Map();
  private lines = new Map<string, RoutedLine>();
  private scene: Scene | null = null;
  /** The scene without the line that is being dragged. */
  private given: Scene | null = null;
  /** The waypoints of a line while it is dragged. `settled`: the next scene has them already. */
  private dragged: { id: string; waypoints: readonly Point[]; settled: boolean } | null = null;
  private opened: string | null = null;
  private worker: Worker | null = null;
  /** Calls off the start of the worker, which waits for the first view. */
  private callOff = () => {};
  private busy = false;
  private waiting: Scene | null = null;
  /** Called once, when the worker has routed the last scene. */
  private readonly atRouted = new Set<() => void>();
  /** The time until which lines are not updated again, and the timer that updates them then. */
  private restsUntil = 0;
  private resting: ReturnType<typeof setTimeout> | undefined;

  /** Takes the current scene and draws its lines, now or when their share of the time allows it. */
  show(given: Scene): void {
    if (this.dragged?.settled) this.dragged = null;
    this.given = given;
    const rest = Math.max(0, this.restsUntil - tick());
    // With many lines the cards come first; the first drawing comes at once.
    const atOnce = this.scene === null || given.lines.length <= MANY;
    if (rest === 0 && atOnce) this.draw();
    else this.resting ??= setTimeout(() => this.draw(), rest);
  }

  private draw(): void {
    clearTimeout(this.resting);
    this.resting = undefined;
    if (!this.given) return;
    const scene = this.withDragged(this.given);
    if (this.scene && sameScene(this.scene, scene)) return;
    const began = tick();
    this.scene = scene;
    this.simple = simpleLines(scene);
    this.refresh(new Set([...this.lines.keys(), ...this.simple.keys()]));
    this.send(scene);
    const took = tick() - began;
    this.restsUntil = scene.lines.length > MANY ? began + took / SHARE : 0;
  }

  /** Draws a line through other waypoints while they are dragged. */
  dragLine(id: string, waypoints: readonly Point[]): void {
    this.dragged = { id, waypoints, settled: false };
    if (this.given) this.show(this.given);
  }

  /** Ends a drag. If the waypoints are `kept`, the next scene has them. */
  endDrag(kept: boolean): void {
    if (!this.dragged) return;
    this.dragged = kept ? { ...this.dragged, settled: true } : null;
    if (!kept && this.given) this.show(this.given);
  }

  /** Return the nearest place of the grid on which lines run. */
  snapped([x, y]: Point): Point {
    const { direction, offset } = this.scene ?? { direction: "right", offset: 0 };
    const [column, row] = direction === "right" ? [0, offset] : [offset, 0];
    const near = (value: number, from: number) => Math.round((value - from) / STEP) * STEP + from;
    return [near(x, column), near(y, row)];
  }

  private withDragged(scene: Scene): Scene {
    const { dragged } = this;
    if (!dragged) return scene;
    const lines = scene.lines.map((line) =>
      line.id === dragged.id ? { ...line, waypoints: dragged.waypoints } : line,
    );
    return { ...scene, lines };
  }

  lineOf(id: string): RoutedLine | null {
    return this.lines.get(id) ?? null;
  }

  /** Shows the single outcomes of one bundle; null: of none. */
  open(id: string | null): void {
    const before = this.opened;
    if (before === id) return;
    this.opened = id;
    for (const each of [before, id]) if (each !== null) this.tell(each);
  }

  isOpen(id: string): boolean {
    return this.opened === id;
  }

  /** Yields all points of all lines. */
  *points(): Generator<Point> {
    for (const { points } of this.lines.values()) yield* points;
  }

  /** Resolves when all lines are routed; never if the canvas closes before. */
  whenRouted(): Promise<void> {
    if (!this.busy) return Promise.resolve();
    return new Promise((resolve) => this.atRouted.add(resolve));
  }

  get offset(): number | null {
    return this.scene?.offset ?? null;
  }

  subscribe(id: string, listener: () => void): () => void {
    const known = this.listeners.get(id) ?? new Set();
    this.listeners.set(id, known.add(listener));
    return () => {
      known.delete(listener);
      if (known.size === 0) this.listeners.delete(id);
    };
  }

  /** Ends the worker and forgets the scene; the next scene starts another worker. */
  close(): void {
    clearTimeout(this.resting);
    this.resting = undefined;
    this.restsUntil = 0;
    this.callOff();
    this.worker?.terminate();
    this.worker = null;
    this.busy = false;
    this.waiting = null;
    this.atRouted.clear();
    this.scene = null;
    this.given = null;
    this.dragged = null;
  }

  private tell(id: string): void {
    for (const listener of [...(this.listeners.get(id) ?? [])]) listener();
  }

  private refresh(ids: Iterable<string>): void {
    for (const id of ids) {
      const simple = this.simple.get(id);
      const before = this.lines.get(id);
      const line = simple && lineNow(this.routed.get(id), simple);
      if (!line) this.lines.delete(id);
      else if (!before || !sameLine(before, line)) this.lines.set(id, line);
      else continue;
      this.tell(id);
    }
  }

  /** Sends one scene at a time to the worker; of those that come meanwhile only the last is routed. */
  private send(scene: Scene): void {
    if (typeof Worker === "undefined" || scene.lines.length === 0) return;
    if (this.busy) {
      this.waiting = scene;
      return;
    }
    this.busy = true;
    if (this.worker !== null) {
      this.worker.postMessage(scene);
      return;
    }
    const post = () => {
      this.worker = this.begin();
      this.worker.postMessage(scene);
    };
    this.callOff = onFirstView(post);
  }

  private begin(): Worker {
    const worker = new Worker(new URL("./router.worker.ts", import.meta.url), { type: "module" });
    worker.addEventListener("message", ({ data }: MessageEvent<RouterReport>) => {
      for (const line of data.changed) this.routed.set(line.id, line);
      for (const id of data.gone) this.routed.delete(id);
      this.busy = false;
      this.refresh([...data.changed.map(({ id }) => id), ...data.gone]);
      const next = this.waiting;
      this.waiting = null;
      if (next) return this.send(next);
      for (const resolve of this.atRouted) resolve();
      this.atRouted.clear();
    });
    return worker;
  }
}

function sameLine(a: RoutedLine, b: RoutedLine): boolean {
  return a === b || JSON.stringify(a) === JSON.stringify(b);
}

function sameScene(a: Scene, b: Scene): boolean {
  const { direction, offset, cards, lines } = a;
  return (
    direction === b.direction &&
    offset === b.offset &&
    cards.length === b.cards.length &&
    lines.length === b.lines.length &&
    cards.every((card, i) => {
      const other = b.cards[i];
      return (
        other !== undefined &&
        card.key === other.key &&
        card.x === other.x &&
        card.y === other.y &&
        card.width === other.width &&
        card.height === other.height
      );
    }) &&
    lines.every((line, i) => {
      const other = b.lines[i];
      const same = other?.id === line.id && other.pill?.width === line.pill?.width;
      return (
        same &&
        (other.waypoints === line.waypoints || String(other.waypoints) === String(line.waypoints))
      );
    })
  );
}

/** The lines of the surrounding canvas. */
export const LineContext = createContext<LineStore>(new LineStore());

/** Return the line of a bundle; null while it is unknown. */
export function useLine(id: string): RoutedLine | null {
  const store = useContext(LineContext);
  const subscribe = useCallback((tell: () => void) => store.subscribe(id, tell), [store, id]);
  return useSyncExternalStore(subscribe, () => store.lineOf(id));
}

/** Return whether the single outcomes of a bundle are shown. */
export function useIsOpen(id: string): boolean {
  const store = useContext(LineContext);
  const subscribe = useCallback((tell: () => void) => store.subscribe(id, tell), [store, id]);
  return useSyncExternalStore(subscribe, () => store.isOpen(id));
}

/** Functions that change lines by hand; without them lines are read-only. */
export interface LineEditing {
  /** Leads a line through these places. `byKey`: repeated key presses are one step of undo. */
  bend(bundle: Bundle, waypoints: readonly Point[], byKey?: boolean): void;
  /** Leads one outcome to the card at a place on screen. */
  drop(bundle: Bundle, outcome: Precondition, at: Position): void;
  /** Asks to which card one outcome shall lead. */
  choose(bundle: Bundle, outcome: Precondition): void;
  /** Returns the name of a line, such as “Drive 0 → Grip 0”. */
  nameOf(bundle: Bundle): string;
}

/** Functions to change lines; null where lines are read-only. */
export const LineEditingContext = createContext<LineEditing | null>(null);
