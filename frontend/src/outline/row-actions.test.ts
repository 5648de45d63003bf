import { expect, test } from "vitest";
import type { EditorStore } from "../canvas/editor-store";
import { PLAIN } from "../graph/breakpoints";
import type { Action } from "../graph/model";
import { rowActionsOf } from "./row-actions";
import type { OutlineItem } from "./rows";

const store = { graphsInside: { now: () => null } } as unknown as EditorStore;

const breakpointOf = (breakpoint: object | null) => {
  const action = { name: "Drive", breakpoint: breakpoint && JSON.stringify(breakpoint) };
  const row = { kind: "action", action: action as unknown as Action } as OutlineItem;
  const found = rowActionsOf(row, store).find(({ name }) => name === "breakpoint");
  return [found?.label, found?.detail];
};

test("whoever removes a breakpoint reads its conditions", () => {
  expect(breakpointOf(null)).toEqual(["Set a breakpoint", undefined]);
  expect(breakpointOf({ ...PLAIN, visit: 3 })).toEqual([
    "Remove the breakpoint",
    "A led run waits before this: visit 3",
  ]);
});
