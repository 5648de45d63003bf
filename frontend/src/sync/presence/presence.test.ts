import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Awareness, applyAwarenessUpdate, encodeAwarenessUpdate } from "y-protocols/awareness";
import * as Y from "yjs";
import { type PresenceSource, presenceOf } from "./presence";

let mine: Awareness;
let presence: PresenceSource;

beforeEach(() => {
  vi.useFakeTimers();
  mine = new Awareness(new Y.Doc());
  presence = presenceOf(mine);
});

afterEach(() => {
  presence.close();
  mine.destroy();
  vi.useRealTimers();
});

/** Another page, as the server shows it. */
function other(state: Record<string, unknown>): Awareness {
  const awareness = new Awareness(new Y.Doc());
  clearInterval(awareness._checkInterval as never);
  show(awareness, state);
  return awareness;
}

function show(awareness: Awareness, state: Record<string, unknown> | null): void {
  awareness.setLocalState(state);
  applyAwarenessUpdate(mine, encodeAwarenessUpdate(awareness, [awareness.clientID]), "remote");
}

const ada = { user: { id: "1", name: "Ada", color: "#123456" } };

test("others are listed by name with what the server says of them, and oneself is not", () => {
  other({ user: { id: "2", name: "Zoë" } });
  other({ ...ada, cursor: [1, 2], selection: ["a"], drag: { ids: ["a"], dx: 3, dy: 4 } });
  presence.tell({ selection: ["b"] });
  expect(presence.people()).toMatchObject([
    {
      id: "1",
      name: "Ada",
      color: "#123456",
      presence: { cursor: [1, 2], selection: ["a"], drag: { ids: ["a"], dx: 3, dy: 4 } },
    },
    { id: "2", name: "Zoë", color: "", presence: { selection: [] } },
  ]);
});

test("the state that another page claims is read only where it is well formed", () => {
  other({});
  other({ user: { id: 3, name: "x" } });
  other({ ...ada, cursor: ["a", 1], selection: [1, "a"], editing: {}, drag: { ids: 5, dx: 1 } });
  expect(presence.people().map((person) => person.presence)).toEqual([{ selection: ["a"] }]);
});

test("people who did not change stay the same objects, and a renewed clock is no change", () => {
  const first = other(ada);
  const second = other({ user: { id: "2", name: "Bob", color: "" } });
  const before = presence.people();
  show(first, ada);
  expect(presence.people()).toBe(before);
  show(second, { user: { id: "2", name: "Bob", color: "" }, selection: ["x"] });
  expect(presence.people()).not.toBe(before);
  expect(presence.people()[0]).toBe(before[0]);
  show(second, null);
  expect(presence.people().length).toBe(1);
});

test("listeners hear when somebody comes, moves or goes", () => {
  let heard = 0;
  const leave = presence.onPeople(() => {
    heard += 1;
  });
  const someone = other(ada);
  show(someone, { ...ada, cursor: [1, 1] });
  show(someone, null);
  expect(heard).toBe(3);
  leave();
  other(ada);
  expect(heard).toBe(3);
});

test("a second of movement is told at most twenty times, and its last word arrives", () => {
  let sent = 0;
  mine.on("update", () => {
    sent += 1;
  });
  for (let ms = 0; ms < 1000; ms += 4) {
    presence.tell({ cursor: [ms, 0] });
    vi.advanceTimersByTime(4);
  }
  vi.advanceTimersByTime(100);
  expect(sent).toBeGreaterThan(10);
  expect(sent).toBeLessThanOrEqual(21);
  expect(mine.getLocalState()).toEqual({ selection: [], cursor: [996, 0] });
});

test("a field is taken back with undefined, and saying the same again is not sent", () => {
  presence.tell({ editing: "a|description", selection: ["a"] });
  vi.advanceTimersByTime(100);
  presence.tell({ editing: undefined });
  vi.advanceTimersByTime(100);
  expect(mine.getLocalState()).toEqual({ selection: ["a"] });
  let sent = 0;
  mine.on("update", () => {
    sent += 1;
  });
  presence.tell({ selection: ["a"] });
  vi.advanceTimersByTime(100);
  expect(sent).toBe(0);
});

test("the view of another page is known, and an impossible view is not followed", () => {
  const page = other({ ...ada, view: { x: 10, y: -20, zoom: 0.5 } });
  expect(presence.people()[0]?.presence.view).toEqual({ x: 10, y: -20, zoom: 0.5 });
  for (const view of [{ x: 1, y: 2 }, { x: 1, y: 2, zoom: 0 }, { x: "1", y: 2, zoom: 1 }, null]) {
    show(page, { ...ada, view });
    expect(presence.people()[0]?.presence.view).toBeUndefined();
  }
});

test.each(["Ülle Õunapuu", "名前 さん", "اسم", "🤖🏳️‍🌈", "ключ"])(
  "the name %s arrives as it is",
  (name) => {
    other({ user: { id: "1", name, color: "" }, editing: `k|${name}`, selection: [name] });
    expect(presence.people()[0]).toMatchObject({
      name,
      presence: { editing: `k|${name}`, selection: [name] },
    });
  },
);
