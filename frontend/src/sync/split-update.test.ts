import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { copyOf } from "../testing/edited-graph";
import { piecesOf } from "./split-update";

/** One update with all that `work` changes. */
function updateOf(doc: Y.Doc, work: () => void): Uint8Array {
  let found: Uint8Array = new Uint8Array([0, 0]);
  const take = (update: Uint8Array) => {
    found = update;
  };
  doc.on("update", take);
  doc.transact(work);
  doc.off("update", take);
  return found;
}

const steps = fc.array(
  fc.tuple(fc.constantFrom("set", "erase", "again"), fc.nat(30), fc.string({ maxLength: 40 })),
  { minLength: 1, maxLength: 60, size: "max" },
);

test("the pieces of an update, one after the other, are the update, and none waits for a later one", () => {
  fc.assert(
    fc.property(steps, steps, fc.integer({ min: 40, max: 400 }), (before, script, most) => {
      const doc = new Y.Doc();
      const map = doc.getMap("actions");
      const play = (all: typeof script) => {
        for (const [kind, key, value] of all) {
          if (kind === "erase") map.delete(`${key}`);
          else if (kind === "set") map.set(`${key}`, value);
          else map.set(`${key}`, map.get(`${key}`) ?? null);
        }
      };
      doc.transact(() => play(before));
      const [whole, parts] = [copyOf(doc), copyOf(doc)];
      const update = updateOf(doc, () => play(script));
      Y.applyUpdate(whole, update);
      for (const piece of piecesOf(update, most)) {
        Y.applyUpdate(parts, piece);
        expect(parts.store.pendingStructs).toBeNull();
        expect(parts.store.pendingDs).toBeNull();
      }
      expect(parts.getMap("actions").toJSON()).toEqual(whole.getMap("actions").toJSON());
      expect(Y.encodeStateVector(parts)).toEqual(Y.encodeStateVector(whole));
      expect(Y.encodeStateAsUpdate(parts)).toEqual(Y.encodeStateAsUpdate(whole));
    }),
    { numRuns: 200 },
  );
});

test("no piece is larger than asked for, except one for a single value; a small update is one piece", () => {
  const doc = new Y.Doc();
  const map = doc.getMap("actions");
  const update = updateOf(doc, () => {
    for (let n = 0; n < 500; n += 1) map.set(`key ${n}`, "x".repeat(50));
    map.set("large", "x".repeat(5_000));
  });
  const pieces = piecesOf(update, 2_000);
  const sizes = pieces.map(({ length }) => length).sort((a, b) => b - a);
  expect(sizes[0]).toBeGreaterThan(5_000);
  expect(sizes[1]).toBeLessThanOrEqual(2_050);
  expect(pieces.length).toBeGreaterThan(10);
  expect(piecesOf(update)).toEqual([update]);
});
