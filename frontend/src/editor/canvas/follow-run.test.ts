import fc from "fast-check";
import { expect, test } from "vitest";
import type { Run } from "../../api/runs";
import type { PartOnCard } from "../../canvas/editor-store";
import { CARD } from "../../canvas/geometry/ranks";
import type { Progress } from "../../status/progress";
import { followedBox, followingViewport, heldKeys, runningInside, runningKeys } from "./follow-run";

const frame = { width: 900, height: 500 };
const card = (x: number, y: number) => ({ x, y, width: CARD.width, height: CARD.height });
const zoomed = (zoom: number) => ({ x: 0, y: 0, zoom });

test("an action that runs near the middle does not move the view", () => {
  expect(followingViewport(card(300, 200), frame, zoomed(1))).toBeNull();
});

test("an action that runs outside of the middle is brought into view at the same zoom, with room ahead", () => {
  const next = followingViewport(card(2_000, 200), frame, zoomed(0.8));
  expect(next?.zoom).toBe(0.8);
  const left = 2_000 * 0.8 + (next?.x ?? 0);
  expect(left).toBeGreaterThan(0);
  expect(left + CARD.width * 0.8).toBeLessThan(frame.width / 2 + 20);
});

test("one motion of the view is enough for a card at any place", () => {
  const place = fc.integer({ min: -5_000, max: 5_000 });
  const zoom = fc.double({ min: 0.1, max: 1.5, noNaN: true });
  fc.assert(
    fc.property(place, place, zoom, (x, y, zoom) => {
      const next = followingViewport(card(x, y), frame, zoomed(zoom));
      if (next !== null) expect(followingViewport(card(x, y), frame, next)).toBeNull();
    }),
    { examples: [[-350, 4_882, 1.3102031330810862]] },
  );
});

test("all running actions are shown if they fit, else the latest", () => {
  const places = new Map<string, readonly [number, number]>([
    ["a", [0, 0]],
    ["b", [300, 0]],
    ["far", [9_000, 0]],
  ]);
  const box = (keys: string[]) => followedBox(keys, places, new Map(), frame, 1);
  expect(box(["b", "a"])).toMatchObject({ x: 0, width: 300 + CARD.width });
  expect(box(["far", "a"])).toMatchObject({ x: 9_000, width: CARD.width });
  expect(box(["gone"])).toBeNull();
});

test("a run that waits before actions is followed to them, until it is over", () => {
  const run = (more: object) =>
    ({
      ended_at: null,
      held: { next: [{ action: "Grip_0" }, { action: "Deep_0" }] },
      actions: { Grip_0: { aid: "g" }, Deep_0: { aid: null } },
      ...more,
    }) as unknown as Run;
  expect(heldKeys(run({}))).toBe("g");
  expect(heldKeys(run({ held: null }))).toBe("");
  expect(heldKeys(run({ ended_at: "2026-01-01T00:00:00Z" }))).toBe("");
  expect(heldKeys(undefined)).toBe("");
});

test("an action that runs in a folded frame is followed at its block", () => {
  const runs = (since: number): Progress => ({
    ...{ tone: "run", word: "running", since, took: null, atMost: null },
    ...{ visits: 1, inferred: false, message: null },
  });
  const progress = new Map([
    ["a", runs(1)],
    ["b", runs(3)],
    ["c", runs(2)],
  ]);
  expect(runningKeys(progress)).toEqual(["b", "c", "a"]);
  const blockOf = new Map([
    ["a", "g/1"],
    ["b", "g/1"],
  ]);
  expect(runningKeys(progress, blockOf)).toEqual(["g/1", "c"]);
});

test("an action in an expanded graph is followed at its place, not the whole card", () => {
  const places = new Map([["a", [1_000, 500] as const]]);
  const sizes = new Map([["a", { width: 900, height: 400 }]]);
  const part = (path: string, x: number, tone: string, expanded = false) =>
    ({ path, x, y: 60, width: 208, height: 88, expanded, progress: { tone } }) as PartOnCard;
  const parts = [part("a/b", 20, "run", true), part("a/b/c", 60, "run"), part("a/d", 400, "true")];
  const partsOf = (key: string) => (key === "a" ? parts : []);
  const found = runningInside(["a"], { places, sizes }, { partsOf });
  expect(found.keys).toEqual(["a/b/c"]);
  expect(found.places.get("a/b/c")).toEqual([1_060, 560]);
  expect(runningInside(["a"], { places, sizes }, null).keys).toEqual(["a"]);
});
