import fc from "fast-check";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { graphIn } from "../../testing/edited-graph";
import { mapsOf } from "../document-keys";
import type { Key } from "../model";
import { addAction, addParameter, connect, removeActions, rename, setEntry, undoOf } from ".";
import { type Deleted, Deletions } from "./deletions";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

interface Page {
  readonly doc: Y.Doc;
  readonly deletions: Deletions;
  readonly told: Deleted[];
}

function page(from?: Y.Doc, mayEdit = true): Page {
  const doc = new Y.Doc();
  if (from) Y.applyUpdate(doc, Y.encodeStateAsUpdate(from));
  const deletions = new Deletions(doc, () => mayEdit);
  deletions.open();
  const told: Deleted[] = [];
  deletions.onRenamedMeanwhile((deleted) => told.push(deleted));
  return { doc, deletions, told };
}

function exchange(...pages: readonly Page[]): void {
  for (const from of pages) {
    const update = Y.encodeStateAsUpdate(from.doc);
    for (const to of pages) if (to !== from) Y.applyUpdate(to.doc, update, "network");
  }
}

/** Entry → Drive {speed} → Say; and who may look only. */
function drawn() {
  const ada = page();
  const drive = addAction(ada.doc, { name: "Drive", position: [10, 20] });
  const say = addAction(ada.doc, { name: "Say" });
  addParameter(ada.doc, drive, "in", "speed", '{"pvf_type":"number","pvf_value":5.0}');
  setEntry(ada.doc, drive);
  connect(ada.doc, drive, say, "on_true");
  return { ada, drive, say };
}

const names = ({ doc }: Page) => graphIn(doc).actions.map(({ name }) => name);
const whole = ({ doc }: Page) =>
  JSON.stringify(Object.values(mapsOf(doc)).map((map) => [...map].sort()));

test("an action that is deleted while it is renamed is deleted whole, and the person is told", () => {
  const { ada, drive } = drawn();
  const bob = page(ada.doc);
  removeActions(ada.doc, [drive]);
  rename(bob.doc, drive, "DriveFast");
  exchange(ada, bob);
  vi.advanceTimersByTime(0);
  exchange(ada, bob);
  vi.runAllTimers();
  expect([names(ada), names(bob)]).toEqual([["Say"], ["Say"]]);
  expect([...mapsOf(bob.doc).actions.keys()].some((key) => key.startsWith(drive))).toBe(false);
  expect(bob.told).toEqual([{ key: drive, name: "DriveFast 0" }]);
});

test("a deleted and renamed action can be restored whole, under its new name", () => {
  const { ada, drive, say } = drawn();
  const before = graphIn(ada.doc);
  const bob = page(ada.doc);
  removeActions(ada.doc, [drive]);
  rename(bob.doc, drive, "DriveFast");
  exchange(ada, bob);
  vi.runAllTimers();
  expect(bob.deletions.restore(drive)).toBe(true);
  expect(bob.deletions.restore(drive)).toBe(false);
  exchange(ada, bob);
  vi.runAllTimers();
  for (const { doc } of [ada, bob]) {
    const graph = graphIn(doc);
    const [old] = before.actions;
    expect(graph.actions.find(({ key }) => key === drive)).toEqual({ ...old, name: "DriveFast" });
    expect(graph.relations).toEqual(before.relations);
  }
  undoOf(bob.doc);
  removeActions(ada.doc, [say, drive]);
  exchange(ada, bob);
  bob.deletions.restore(drive);
  expect(graphIn(bob.doc).relations.map(({ child }) => child)).toEqual([drive]);
});

test("another page clears and tells the leftovers where the page that renamed has gone", () => {
  const { ada, drive } = drawn();
  const bob = page(ada.doc);
  removeActions(ada.doc, [drive]);
  rename(bob.doc, drive, "DriveFast");
  Y.applyUpdate(ada.doc, Y.encodeStateAsUpdate(bob.doc), "network");
  expect(names(ada)).toEqual(["DriveFast", "Say"]);
  vi.runAllTimers();
  expect(names(ada)).toEqual(["Say"]);
  expect(ada.told).toHaveLength(1);
});

test("undoing the renaming afterwards leaves nothing half either", () => {
  const { ada, drive } = drawn();
  const bob = page(ada.doc);
  const undo = undoOf(bob.doc);
  removeActions(ada.doc, [drive]);
  rename(bob.doc, drive, "DriveFast");
  exchange(ada, bob);
  vi.runAllTimers();
  undo.undo();
  vi.runAllTimers();
  expect(names(bob)).toEqual(["Say"]);
});

test("undoing the deletion afterwards brings all of it back, under the newest name", () => {
  const { ada, drive } = drawn();
  const before = graphIn(ada.doc);
  const undo = undoOf(ada.doc);
  const bob = page(ada.doc);
  removeActions(ada.doc, [drive]);
  rename(bob.doc, drive, "DriveFast");
  exchange(ada, bob);
  vi.runAllTimers();
  exchange(ada, bob);
  undo.undo();
  exchange(ada, bob);
  vi.runAllTimers();
  for (const { doc } of [ada, bob]) {
    const [old] = before.actions;
    expect(graphIn(doc).actions[0]).toEqual({ ...old, name: "DriveFast" });
    expect(graphIn(doc).relations).toEqual(before.relations);
  }
  undo.redo();
  vi.runAllTimers();
  expect(names(ada)).toEqual(["Say"]);
});

test("a viewer clears nothing", () => {
  const { ada, drive } = drawn();
  const viewer = page(ada.doc, false);
  const bob = page(ada.doc);
  rename(bob.doc, drive, "DriveFast");
  bob.deletions.close();
  removeActions(ada.doc, [drive]);
  ada.deletions.close();
  exchange(ada, bob, viewer);
  const before = whole(viewer);
  vi.runAllTimers();
  expect(whole(viewer)).toBe(before);
});

test("an undone deletion, and an action of an old document without order, stay", () => {
  const { ada, drive } = drawn();
  const undo = undoOf(ada.doc);
  removeActions(ada.doc, [drive]);
  undo.undo();
  const old = new Y.Doc();
  old.getMap("actions").set("abcdefghijkl", "Old");
  const carl = page(old);
  rename(carl.doc, "abcdefghijkl", "Older");
  vi.runAllTimers();
  expect(names(ada)).toEqual(["Drive", "Say"]);
  expect(names(carl)).toEqual(["Older"]);
});

test("all pages show the same and no half action, in whatever order people delete, rename and receive", () => {
  const step = fc.record({
    who: fc.nat(2),
    what: fc.constantFrom("delete", "rename", "undo", "hear", "wait", "restore"),
    at: fc.nat(1),
  });
  fc.assert(
    fc.property(fc.array(step, { maxLength: 25 }), (steps) => {
      const { ada, drive, say } = drawn();
      const pages = [ada, page(ada.doc), page(ada.doc)] as const;
      const undos = pages.map(({ doc }) => undoOf(doc));
      const keys: readonly Key[] = [drive, say];
      for (const { who, what, at } of steps) {
        const here = pages[who] ?? ada;
        const key = keys[at] ?? drive;
        if (what === "delete") removeActions(here.doc, [key]);
        else if (what === "rename") rename(here.doc, key, `N${who}`);
        else if (what === "undo") undos[who]?.undo();
        else if (what === "restore") here.deletions.restore(key);
        else if (what === "hear") exchange(here, pages[(who + 1) % 3] ?? ada);
        else vi.runAllTimers();
      }
      for (let round = 0; round < 4; round += 1) {
        exchange(...pages);
        vi.runAllTimers();
      }
      exchange(...pages);
      for (const here of pages) {
        expect(whole(here)).toBe(whole(ada));
        const actions = mapsOf(here.doc).actions;
        for (const { key } of graphIn(here.doc).actions)
          expect(actions.has(`${key}|order`)).toBe(true);
        here.deletions.close();
      }
    }),
    { numRuns: 60 },
  );
});
