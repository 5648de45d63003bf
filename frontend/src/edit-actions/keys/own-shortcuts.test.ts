import fc from "fast-check";
import { expect, test } from "vitest";
import { EDIT_ACTIONS } from "../all";
import { editActionFor } from "../edit-action";
import {
  assigned,
  isChangeable,
  readOwn,
  refusalOf,
  shortcutOf,
  takenBy,
  withOwn,
} from "./own-shortcuts";

const press = (key: string, held = "") => ({
  key,
  ctrlKey: held.includes("C"),
  metaKey: held.includes("M"),
  altKey: held.includes("A"),
  shiftKey: held.includes("S"),
});
const actionFor = (own: ReturnType<typeof readOwn>, key: string, held = "") =>
  editActionFor(withOwn(EDIT_ACTIONS, own), press(key, held))?.name;

test("keys of one's own replace those that came, and take them from whoever had them", () => {
  const own = assigned(EDIT_ACTIONS, {}, "tidy", ["f"]);
  expect(actionFor(own, "f")).toBe("tidy");
  expect(actionFor(own, "T", "S")).toBeUndefined();
  expect(own).toEqual({ tidy: ["f"], fit: ["Shift+!"] });
  expect(takenBy(EDIT_ACTIONS, "tidy", "f").map(({ name }) => name)).toEqual(["fit"]);
});

test("a shortcut that is reset is not stored any more, and takes its keys back", () => {
  const own = assigned(EDIT_ACTIONS, {}, "tidy", ["Mod+Shift+y"]);
  expect(assigned(EDIT_ACTIONS, own, "tidy", ["Shift+t"])).toEqual({});
});

test("STOP's keys are nobody else's, whatever is held with them and whatever was kept", () => {
  for (const held of ["C", "CS", "CA", "CSA"]) {
    const keys = shortcutOf(press(".", held), false) ?? "";
    expect(refusalOf(keys)).toMatch(/STOP/);
    expect(readOwn(EDIT_ACTIONS, { tidy: [keys] })).toEqual({ tidy: [] });
  }
  expect(refusalOf(shortcutOf(press(".", "M"), true) ?? "")).toMatch(/STOP/);
});

test("shortcuts of one's own are the same on every layout, and older ones of other scripts stay", () => {
  expect(shortcutOf({ ...press("ы", "C"), code: "KeyS" }, false)).toBe("Mod+s");
  const stop = shortcutOf({ ...press("ю", "C"), code: "Period" }, false) ?? "";
  expect(refusalOf(stop)).toMatch(/STOP/);
  const own = assigned(EDIT_ACTIONS, {}, "tidy", ["ф"]);
  const pressed = { ...press("ф"), code: "KeyA" };
  expect(editActionFor(withOwn(EDIT_ACTIONS, own), pressed)?.name).toBe("tidy");
});

test("keys of browsers, screen readers and moving through the page are refused with the reason", () => {
  expect(refusalOf("Mod+w")).toMatch(/Browsers/);
  expect(refusalOf("Mod+Alt+k")).toMatch(/Screen readers/);
  expect(refusalOf("Tab")).toMatch(/without a mouse/);
  expect(refusalOf("ArrowUp")).toMatch(/without a mouse/);
  expect(refusalOf("Mod+Shift+y")).toBeNull();
  expect(shortcutOf(press("Shift", "S"), false)).toBeNull();
  expect(shortcutOf(press("Y", "CS"), false)).toBe("Mod+Shift+y");
  expect(shortcutOf(press("?", "S"), false)).toBe("?");
});

test("no two edit actions share keys and those of the clipboard stay, whatever was stored", () => {
  const keys = fc.oneof(
    fc.constantFrom(
      "f",
      "Mod+c",
      "Mod+.",
      "Tab",
      "Shift+t",
      "Mod+Shift+.",
      "Shift+?",
      "",
      "+",
      "a",
    ),
    fc.string({ maxLength: 5 }),
  );
  const name = fc.oneof(fc.constantFrom(...EDIT_ACTIONS.map((each) => each.name)), fc.string());
  fc.assert(
    fc.property(fc.oneof(fc.dictionary(name, fc.array(keys)), fc.json()), (kept) => {
      const shown = withOwn(EDIT_ACTIONS, readOwn(EDIT_ACTIONS, kept));
      const all = shown.flatMap(({ shortcuts }) => shortcuts);
      for (const each of shown) {
        for (const one of each.shortcuts) expect(takenBy(shown, each.name, one)).toEqual([]);
      }
      expect(all.some((one) => /STOP/.test(refusalOf(one) ?? ""))).toBe(false);
      for (const each of EDIT_ACTIONS.filter((action) => !isChangeable(action))) {
        expect(shown.find((action) => action.name === each.name)).toEqual(each);
      }
    }),
  );
});
