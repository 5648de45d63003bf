import { expect, test } from "vitest";
import { ENTRY, EXIT } from "../graph/model";
import { expectedCard, expectedEnd } from "./card-handles";

const plain = { inputs: [] };

test("a card that was never rendered has a size and handles, so that it need not be rendered", () => {
  for (const direction of ["right", "down"] as const) {
    const { measured, handles } = expectedCard(plain, direction);
    expect(measured.width * measured.height).toBeGreaterThan(0);
    expect(handles.map(({ id }) => id)).toEqual([
      "in",
      "on_true",
      "on_false",
      "on_error",
      "on_stopped",
    ]);
    for (const { x, y, width = 0, height = 0 } of handles) {
      const [cx, cy] = [x + width / 2, y + height / 2];
      expect([0, measured.width].includes(cx) || [0, measured.height].includes(cy)).toBe(true);
    }
    expect(expectedEnd(ENTRY, direction).handles.map(({ type }) => type)).toEqual(["source"]);
    expect(expectedEnd(EXIT, direction).handles.map(({ type }) => type)).toEqual(["target"]);
  }
});

test("cards of one size share one object", () => {
  expect(expectedCard({ ...plain }, "right")).toBe(expectedCard({ ...plain }, "right"));
  expect(expectedCard(plain, "right")).not.toBe(expectedCard(plain, "down"));
});
