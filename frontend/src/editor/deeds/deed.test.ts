import { expect, test } from "vitest";
import type { Bench } from "../bench";
import { DEEDS } from "./all";
import { deedFor, isEnabled, isPressed, keysOf, labelOf } from "./deed";

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
  expect(deedFor(DEEDS, press("z"))).toBeNull();
});

test("a plain letter with Ctrl belongs to the browser", () => {
  expect(deedFor(DEEDS, press("f", { ctrlKey: true }))).toBeNull();
});

test("Mod is the command key on a Mac", () => {
  expect(isPressed("Mod+z", press("z", { metaKey: true }), true)).toBe(true);
  expect(isPressed("Mod+z", press("z", { ctrlKey: true }), true)).toBe(false);
  expect(keysOf("Mod+Shift+z", true)).toEqual(["⌘", "⇧", "Z"]);
});

test("who may only look is offered nothing that changes the graph, and told why", () => {
  const bench = {
    mayEdit: false,
    canUndo: true,
    canRedo: true,
    graph: { actions: [{ key: "a" }], relations: [] },
    selection: new Set(["a"]),
  } as unknown as Bench;
  const off = DEEDS.filter((deed) => !isEnabled(deed, bench));
  expect(off.map((deed) => deed.name)).toEqual(
    DEEDS.filter((deed) => deed.changes).map((deed) => deed.name),
  );
  expect(off.length).toBeGreaterThan(4);
  for (const deed of off) expect(labelOf(deed, bench)).toBe(`${deed.label} (view only)`);
  for (const deed of off) expect(isEnabled(deed, { ...bench, mayEdit: true })).toBe(true);
});
