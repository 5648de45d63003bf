import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { layeredScene, seeded } from "../../testing/scenes";
import { LineStore } from "./line-store";
import { routed } from "./routes";
import type { Scene } from "./scene";

/** What the page has asked of its worker, and how the worker answers. */
class FakeWorker {
  static readonly all: FakeWorker[] = [];
  readonly asked: Scene[] = [];
  ended = false;
  private hear: (event: { data: unknown }) => void = () => undefined;

  constructor() {
    FakeWorker.all.push(this);
  }
  addEventListener(_: string, hear: (event: { data: unknown }) => void): void {
    this.hear = hear;
  }
  postMessage(scene: Scene): void {
    this.asked.push(scene);
  }
  terminate(): void {
    this.ended = true;
  }
  answer(): void {
    const scene = this.asked.at(-1);
    if (scene) this.hear({ data: { changed: [...routed(scene).lines.values()], gone: [] } });
  }
}

beforeEach(() => {
  FakeWorker.all.length = 0;
  vi.stubGlobal("Worker", FakeWorker);
});
afterEach(() => vi.unstubAllGlobals());

const scene = layeredScene(12, seeded(8), "right");
const moved = (dx: number): Scene => ({
  ...scene,
  cards: scene.cards.map((card, i) => (i === 5 ? { ...card, x: card.x + dx } : card)),
});
const id = scene.lines[0]?.id ?? "";

test("simple lines are drawn at once, and replaced when the worker has routed ones", () => {
  const store = new LineStore();
  const told: string[] = [];
  for (const line of scene.lines) store.subscribe(line.id, () => told.push(line.id));
  store.show(scene);
  expect(store.lineOf(id)?.simple).toBe(true);
  expect(new Set(told).size).toBe(scene.lines.length);
  FakeWorker.all[0]?.answer();
  expect(store.lineOf(id)?.simple).toBe(false);
  store.show({ ...scene });
  expect(FakeWorker.all[0]?.asked.length).toBe(1); // nothing has changed
});

test("while the worker is busy, only the last scene waits", () => {
  const store = new LineStore();
  store.show(scene);
  for (const dx of [3, 6, 9]) store.show(moved(dx));
  const [worker] = FakeWorker.all;
  expect(worker?.asked.length).toBe(1);
  worker?.answer();
  expect(worker?.asked.map(({ cards }) => cards[5]?.x)).toEqual([
    scene.cards[5]?.x,
    (scene.cards[5]?.x ?? 0) + 9,
  ]);
});

test("only lines that look different notify their arrows", () => {
  const store = new LineStore();
  store.show(scene);
  FakeWorker.all[0]?.answer();
  const told = new Set<string>();
  for (const line of scene.lines) store.subscribe(line.id, () => told.add(line.id));
  store.show(moved(2));
  const own = scene.lines.filter(({ source, target }) => source === "c5" || target === "c5");
  expect([...told].sort()).toEqual(own.map(({ id }) => id).sort());
});

test("one bundle at a time is open, and only its arrows are notified", () => {
  const store = new LineStore();
  const told: string[] = [];
  for (const each of ["a", "b"]) store.subscribe(each, () => told.push(each));
  store.open("a");
  store.open("b");
  expect([store.isOpen("a"), store.isOpen("b"), told]).toEqual([false, true, ["a", "a", "b"]]);
});

test("closing a canvas ends its worker", () => {
  const store = new LineStore();
  store.show(scene);
  store.close();
  expect(FakeWorker.all[0]?.ended).toBe(true);
});

test("a dragged line stays where it was dropped until the graph has its waypoints", () => {
  const store = new LineStore();
  store.show(scene);
  const waypoints = () => store.lineOf(id)?.waypoints;
  const at = store.snapped([301, 205]);
  store.dragLine(id, [at]);
  expect(waypoints()).toEqual([at]);
  store.endDrag(true);
  expect(waypoints()).toEqual([at]);
  store.show({
    ...scene,
    lines: scene.lines.map((l) => (l.id === id ? { ...l, waypoints: [at] } : l)),
  });
  expect(waypoints()).toEqual([at]);
  // What is left is as it was, at once.
  store.dragLine(id, [[0, 0]]);
  store.endDrag(false);
  expect(waypoints()).toEqual([at]);
});

test("with many lines updates pause between moves, and end at the final places", async () => {
  const many = layeredScene(400, seeded(3), "right");
  expect(many.lines.length).toBeGreaterThan(300);
  const led = many.lines[0];
  const at = (dx: number): Scene => ({
    ...many,
    cards: many.cards.map((card) =>
      card.key === led?.source ? { ...card, x: card.x + dx } : card,
    ),
  });
  const store = new LineStore();
  store.show(many);
  const before = store.lineOf(led?.id ?? "")?.points[0]?.[0] ?? Number.NaN;
  for (const dx of [5, 10, 15]) store.show(at(dx));
  const told = vi.fn();
  store.subscribe(led?.id ?? "", told);
  const now = () => store.lineOf(led?.id ?? "")?.points[0]?.[0];
  await vi.waitFor(() => expect(now()).toBe(before + 15), { timeout: 20_000 });
  expect(told.mock.calls.length).toBeLessThanOrEqual(1);
  store.close();
});
