import { expect, test } from "vitest";
import { DEEDS } from "./all";
import { deedFor, isPressed, keysOf } from "./deed";

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
