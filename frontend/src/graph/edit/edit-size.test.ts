import { expect, test } from "vitest";
import { docWith, graphIn, updatesOf } from "../../testing/edited-graph";
import { rootOf } from "../document-keys";
import type { Key } from "../model";
import { addAction, asOneEdit, connect, removeActions, setField } from ".";
import { MOST_VALUE_BYTES, onTooLarge } from "./edit-size";

test("an edit with a value that no message could hold changes nothing, and its size is told", () => {
  const [doc, a, b] = docWith("A", "B") as [ReturnType<typeof docWith>[0], Key, Key];
  connect(doc, a, b);
  setField(doc, a, "description", "old");
  const before = graphIn(doc);
  const told: number[] = [];
  const stop = onTooLarge(doc, (bytes) => told.push(bytes));
  let sent = 0;
  doc.on("update", (update: Uint8Array) => {
    sent += update.length;
  });
  const large = "ä".repeat(MOST_VALUE_BYTES / 2 + 1);
  setField(doc, a, "description", large);
  asOneEdit(doc, () => {
    removeActions(doc, [b]);
    addAction(doc, { name: "C", description: large });
    setField(doc, a, "actor", "r");
    rootOf(doc, "meta").set("fresh", 1);
    rootOf(doc, "meta").delete("fresh");
  });
  expect(graphIn(doc)).toEqual(before);
  expect(told).toEqual([MOST_VALUE_BYTES + 2, MOST_VALUE_BYTES + 2]);
  expect(sent).toBeLessThan(10_000);
  stop();
  setField(doc, a, "description", large);
  expect(told).toHaveLength(2);
});

test("the largest value that is allowed is one update that a room takes", () => {
  const [doc, a] = docWith("A") as [ReturnType<typeof docWith>[0], Key];
  let largest = 0;
  doc.on("update", (update: Uint8Array) => {
    largest = Math.max(largest, update.length);
  });
  expect(updatesOf(doc, () => setField(doc, a, "description", "x".repeat(MOST_VALUE_BYTES)))).toBe(
    1,
  );
  expect(largest).toBeLessThanOrEqual(1 << 20);
  expect(largest).toBeGreaterThan(MOST_VALUE_BYTES);
});
