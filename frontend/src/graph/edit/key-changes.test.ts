import fc from "fast-check";
import { expect, test } from "vitest";
import type * as Y from "yjs";
import { copyOf, docWith, exchange, graphIn } from "../../testing/edited-graph";
import { mapsOf, rootOf, splitKey } from "../document-keys";
import type { Key } from "../model";
import { addAction, connect, moveActions, removeActions, setField, undoOf } from ".";
import { applyActionChanges, collisionsOfActions, type DocumentChange } from "./key-changes";

const NEW = "newAction012";

/** A graph of three in a line, and what makes one new action of the second. */
function folded(): { doc: Y.Doc; keys: Key[]; changes: DocumentChange[] } {
  const [doc, ...keys] = docWith("Look", "Grip", "Place") as [Y.Doc, Key, Key, Key];
  const [look, grip, place] = keys as [Key, Key, Key];
  connect(doc, look, grip, "on_true", "run");
  connect(doc, grip, place, "on_true", "run");
  moveActions(doc, new Map(keys.map((key, i) => [key, [0, i * 200]])));
  const changes: DocumentChange[] = [];
  for (const root of ["actions", "relations", "positions"] as const) {
    for (const [key, before] of rootOf(doc, root).entries()) {
      if (!key.includes(grip)) continue;
      changes.push({ root, key, before });
      if (!key.includes("|po") && splitKey(key).rest !== "order")
        changes.push({ root, key: key.replace(grip, NEW), after: key === grip ? "Take" : before });
    }
  }
  return { doc, keys, changes };
}

const plain = (doc: Y.Doc) => JSON.stringify(graphIn(doc));

test("one edit takes the actions away, and one undo brings all back", () => {
  const { doc, changes } = folded();
  const undo = undoOf(doc);
  const before = plain(doc);
  expect(collisionsOfActions(doc, changes)).toEqual([]);
  applyActionChanges(doc, changes);
  expect(
    graphIn(doc)
      .actions.map(({ name }) => name)
      .sort(),
  ).toEqual(["Look", "Place", "Take"]);
  undo.undo();
  expect(plain(doc)).toBe(before);
});

test("changes of the actions meanwhile are told, and no others", () => {
  const told = (edit: (doc: Y.Doc, keys: Key[]) => void) => {
    const { doc, keys, changes } = folded();
    edit(doc, keys);
    return collisionsOfActions(doc, changes).length;
  };
  expect(told((doc, [, grip]) => setField(doc, grip as Key, "description", "gently"))).toBe(1);
  expect(told((doc, [, grip]) => setField(doc, grip as Key, "type", "async"))).toBe(1);
  expect(
    told((doc, [look, , place]) => connect(doc, place as Key, look as Key, "on_false", "run")),
  ).toBe(0);
  expect(
    told((doc, [, grip]) => connect(doc, grip as Key, grip as Key, "on_false", "run")),
  ).toBeGreaterThan(0);
  expect(
    told((doc, [, grip, place]) => connect(doc, place as Key, grip as Key, "on_false", "run")),
  ).toBeGreaterThan(0);
  expect(
    told((doc, [look, grip]) => connect(doc, look as Key, grip as Key, "on_false", "run")),
  ).toBeGreaterThan(0);
  expect(told((doc, [, grip]) => removeActions(doc, [grip as Key]))).toBeGreaterThan(0);
  expect(told((doc, [look]) => setField(doc, look as Key, "description", "far"))).toBe(0);
  expect(told((doc) => addAction(doc, { name: "Grip" }))).toBe(0);
  expect(told((doc, [, grip]) => moveActions(doc, new Map([[grip as Key, [7, 7]]])))).toBe(0);
});

test("things that somebody moved meanwhile stay where they are", () => {
  const { doc, keys } = folded();
  const place = keys[2] as Key;
  const away = { root: "positions", key: place, before: [0, 400], after: [0, 600] };
  moveActions(doc, new Map([[place, [90, 90]]]));
  applyActionChanges(doc, [away]);
  expect(rootOf(doc, "positions").get(place)).toEqual([90, 90]);
  moveActions(doc, new Map([[place, [0, 400]]]));
  applyActionChanges(doc, [away]);
  expect(rootOf(doc, "positions").get(place)).toEqual([0, 600]);
});

test("edits of others elsewhere survive, also when this one is undone", () => {
  const words = fc.string({ minLength: 1, maxLength: 6 });
  fc.assert(
    fc.property(fc.array(fc.tuple(fc.constantFrom(0, 2), words), { maxLength: 6 }), (edits) => {
      const { doc, keys, changes } = folded();
      const other = copyOf(doc);
      const undo = undoOf(doc);
      const before = graphIn(doc).relations.length;
      for (const [which, text] of edits) setField(other, keys[which] as Key, "description", text);
      applyActionChanges(doc, changes);
      exchange(doc, other);
      expect(mapsOf(other)).toEqual(mapsOf(doc));
      undo.undo();
      exchange(doc, other);
      expect(mapsOf(other)).toEqual(mapsOf(doc));
      expect(graphIn(doc).relations).toHaveLength(before);
      for (const which of [0, 2]) {
        const last = edits.filter(([each]) => each === which).at(-1)?.[1] ?? "";
        const action = graphIn(doc).actions.find(({ key }) => key === keys[which]);
        expect(action?.description).toBe(last);
      }
    }),
  );
});
