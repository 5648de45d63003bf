import { expect, test } from "vitest";
import { EMPTY_GRAPH } from "../graph/model";
import { DEEDS } from "./all";
import { deedFor, isEnabled, isPressed, keysOf, labelOf } from "./edit-action";
import type { EditorContext } from "./editor-context";

const press = (
  key: string,
  mods: Partial<Record<"ctrlKey" | "metaKey" | "shiftKey" | "altKey", boolean>> = {},
) => ({
  key,
  ctrlKey: false,
  metaKey: false,
  shiftKey: false,
  altKey: false,
  ...mods,
});

test("no two deeds share a shortcut", () => {
  const all = DEEDS.flatMap((deed) => deed.shortcuts);
  expect(new Set(all).size).toBe(all.length);
});

test("undo and redo are told apart by Shift", () => {
  expect(deedFor(DEEDS, press("z", { ctrlKey: true }))?.name).toBe("undo");
  expect(deedFor(DEEDS, press("Z", { ctrlKey: true, shiftKey: true }))?.name).toBe("redo");
  expect(deedFor(DEEDS, press("z"))?.name).toBe("zoom-selection");
});

test("letters that stand alone can be switched off, and nothing else with them", () => {
  expect(deedFor(DEEDS, press("c"))?.name).toBe("connect");
  expect(deedFor(DEEDS, press("c"), false)).toBeNull();
  expect(deedFor(DEEDS, press("Delete"), false)?.name).toBe("remove");
  expect(deedFor(DEEDS, press("z", { ctrlKey: true }), false)?.name).toBe("undo");
});

test("a plain letter with Ctrl belongs to the browser", () => {
  expect(deedFor(DEEDS, press("p", { ctrlKey: true }))).toBeNull();
});

test("Mod is the command key on a Mac", () => {
  expect(isPressed("Mod+z", press("z", { metaKey: true }), true)).toBe(true);
  expect(isPressed("Mod+z", press("z", { ctrlKey: true }), true)).toBe(false);
  expect(keysOf("Mod+Shift+z", true)).toEqual(["⌘", "⇧", "Z"]);
});

test("who may only look is offered nothing that changes the graph, and told why", () => {
  const context = {
    mayEdit: false,
    canUndo: true,
    canRedo: true,
    graph: { ...EMPTY_GRAPH, actions: [{ key: "a" }] },
    selection: new Set(["a"]),
    positions: () => new Map([["a", [0, 0]]]),
    sizes: () => new Map(),
  } as unknown as EditorContext;
  const changing = DEEDS.filter((deed) => deed.changes);
  for (const deed of changing) {
    expect(isEnabled(deed, context)).toBe(false);
    expect(labelOf(deed, context)).toBe(`${deed.label} (view only)`);
  }
  const editor = { ...context, mayEdit: true };
  expect(changing.filter((deed) => isEnabled(deed, editor)).length).toBeGreaterThan(10);
  const [copy] = DEEDS.filter(({ name }) => name === "copy");
  expect(copy && isEnabled(copy, context)).toBe(true);
});
