/** The lines of one canvas: simple ones at once, routed ones when a worker has them. */
import { createContext, useCallback, useContext, useSyncExternalStore } from "react";
import { lineNow } from "./line-path";
import type { RouterReport } from "./router.worker";
import { type RoutedLine, simpleLines } from "./routes";
import type { Point, Scene } from "./scene";

/** Arrows listen for themselves, so that a card that moves draws only its own again. */
export class LineStore {
  private readonly listeners = new Map<string, Set<() => void>>();
  private readonly routed = new Map<string, RoutedLine>();
  private simple: ReadonlyMap<string, RoutedLine> = new Map();
  private lines = new Map<string, RoutedLine>();
  private scene: Scene | null = null;
  private opened: string | null = null;
  private worker: Worker | null = null;
  private busy = false;
  private waiting: Scene | null = null;

  /** The scene as it is now. */
  show(scene: Scene): void {
    if (this.scene && sameScene(this.scene, scene)) return;
    this.scene = scene;
    this.simple = simpleLines(scene);
    this.refresh(new Set([...this.lines.keys(), ...this.simple.keys()]));
    this.send(scene);
  }

  lineOf(id: string): RoutedLine | null {
    return this.lines.get(id) ?? null;
  }

  /** Shows the single outcomes of one bundle. */
  open(id: string | null): void {
    const before = this.opened;
    if (before === id) return;
    this.opened = id;
    for (const each of [before, id]) if (each !== null) this.tell(each);
  }

  isOpen(id: string): boolean {
    return this.opened === id;
  }

  /** All points of all lines. */
  *points(): Generator<Point> {
    for (const { points } of this.lines.values()) yield* points;
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

  /** Ends the worker; the next scene starts another. */
  close(): void {
    this.worker?.terminate();
    this.worker = null;
    this.busy = false;
    this.waiting = null;
    this.scene = null;
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

  /** One scene at a time; of those that come meanwhile only the last is routed. */
  private send(scene: Scene): void {
    if (typeof Worker === "undefined" || scene.lines.length === 0) return;
    if (this.busy) {
      this.waiting = scene;
      return;
    }
    this.worker ??= this.begin();
    this.busy = true;
    this.worker.postMessage(scene);
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
      if (next) this.send(next);
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
      return other?.id === line.id && other.pill?.width === line.pill?.width;
    })
  );
}

export const LineContext = createContext<LineStore>(new LineStore());

/** The line of a bundle; null while nothing is known of it. */
export function useLine(id: string): RoutedLine | null {
  const store = useContext(LineContext);
  const subscribe = useCallback((tell: () => void) => store.subscribe(id, tell), [store, id]);
  return useSyncExternalStore(subscribe, () => store.lineOf(id));
}

/** Whether the single outcomes of a bundle are shown. */
export function useIsOpen(id: string): boolean {
  const store = useContext(LineContext);
  const subscribe = useCallback((tell: () => void) => store.subscribe(id, tell), [store, id]);
  return useSyncExternalStore(subscribe, () => store.isOpen(id));
}
