import { expect, test } from "vitest";
import { EditorStore } from "../canvas/editor-store";
import { EMPTY_GRAPH } from "../graph/model";
import { EDIT_ACTIONS } from "./all";
import { editActionFor, isEnabled, isPressed, labelOf, printedKeys } from "./edit-action";
import { type EditorContext, freePosition } from "./editor-context";
import { neighbour } from "./view";

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

test("no two edit actions share a shortcut", () => {
  const all = EDIT_ACTIONS.flatMap((editAction) => editAction.shortcuts);
  expect(new Set(all).size).toBe(all.length);
});

test("undo and redo are told apart by Shift", () => {
  expect(editActionFor(EDIT_ACTIONS, press("z", { ctrlKey: true }))?.name).toBe("undo");
  expect(editActionFor(EDIT_ACTIONS, press("Z", { ctrlKey: true, shiftKey: true }))?.name).toBe(
    "redo",
  );
  expect(editActionFor(EDIT_ACTIONS, press("z"))?.name).toBe("zoom-selection");
});

test("shortcuts work on Cyrillic, Greek and Arabic layouts, by the place of the key", () => {
  const typed = (key: string, code: string, mods = {}) => ({ ...press(key, mods), code });
  const nameOf = (event: ReturnType<typeof typed>) => editActionFor(EDIT_ACTIONS, event)?.name;
  for (const key of ["я", "ζ", "ئ", "ㅋ"]) {
    expect(nameOf(typed(key, "KeyZ", { ctrlKey: true }))).toBe("undo");
    expect(nameOf(typed(key, "KeyZ", { ctrlKey: true, shiftKey: true }))).toBe("redo");
  }
  expect(nameOf(typed("с", "KeyC"))).toBe("connect"); // the Cyrillic letter
  expect(nameOf(typed("w", "KeyZ", { ctrlKey: true }))).toBeUndefined(); // French
  const composing = { ...typed("Enter", "Enter"), isComposing: true };
  expect(editActionFor(EDIT_ACTIONS, composing)).toBeNull();
});

test("letters that stand alone can be switched off, and nothing else with them", () => {
  expect(editActionFor(EDIT_ACTIONS, press("c"))?.name).toBe("connect");
  expect(editActionFor(EDIT_ACTIONS, press("c"), false)).toBeNull();
  expect(editActionFor(EDIT_ACTIONS, press("Delete"), false)?.name).toBe("remove");
  expect(editActionFor(EDIT_ACTIONS, press("z", { ctrlKey: true }), false)?.name).toBe("undo");
});

test("a plain letter with Ctrl belongs to the browser", () => {
  expect(editActionFor(EDIT_ACTIONS, press("p", { ctrlKey: true }))).toBeNull();
});

test("Mod is the command key on a Mac", () => {
  expect(isPressed("Mod+z", press("z", { metaKey: true }), true)).toBe(true);
  expect(isPressed("Mod+z", press("z", { ctrlKey: true }), true)).toBe(false);
  expect(printedKeys("Mod+Shift+z", true)).toEqual(["⌘", "⇧", "Z"]);
});

test("a viewer is offered no change of the graph, and is told why", () => {
  const context = {
    store: new EditorStore(),
    mayEdit: false,
    canUndo: true,
    canRedo: true,
    graph: { ...EMPTY_GRAPH, actions: [{ key: "a" }] },
    selection: new Set(["a"]),
    positions: () => new Map([["a", [0, 0]]]),
    sizes: () => new Map(),
  } as unknown as EditorContext;
  const changing = EDIT_ACTIONS.filter((editAction) => editAction.changes);
  for (const editAction of changing) {
    expect(isEnabled(editAction, context)).toBe(false);
    expect(labelOf(editAction, context)).toBe(`${editAction.label} (view only)`);
  }
  const editor = { ...context, mayEdit: true };
  expect(changing.filter((editAction) => isEnabled(editAction, editor)).length).toBeGreaterThan(10);
  const [copy] = EDIT_ACTIONS.filter(({ name }) => name === "copy");
  expect(copy && isEnabled(copy, context)).toBe(true);
});

test("the arrow keys walk in the direction of the graph", () => {
  const relations = [
    { parent: "a", child: "b" },
    { parent: "b", child: "c" },
    { parent: "b", child: "d" },
  ];
  const standing = (direction: "right" | "down", places: Record<string, [number, number]>) =>
    ({
      graph: { ...EMPTY_GRAPH, direction, relations, actions: [{ key: "a" }] },
      selection: new Set(["b"]),
      positions: () => new Map(Object.entries(places)),
    }) as unknown as EditorContext;
  const right = standing("right", { a: [0, 0], b: [300, 0], c: [600, -80], d: [600, 90] });
  expect([neighbour(right, "right"), neighbour(right, "left")]).toEqual(["c", "a"]);
  const down = standing("down", { a: [0, 0], b: [0, 200], c: [-150, 400], d: [160, 400] });
  expect([neighbour(down, "down"), neighbour(down, "up")]).toEqual(["c", "a"]);
  const beside = { ...right, selection: new Set(["c"]) } as EditorContext;
  expect([neighbour(beside, "down"), neighbour(beside, "up")]).toEqual(["d", null]);
});

test("one more action goes behind what is chosen, where it is free", () => {
  const standing = (direction: "right" | "down") =>
    ({
      graph: { ...EMPTY_GRAPH, direction, actions: [{ key: "a" }, { key: "b" }] },
      selection: new Set(["a"]),
      positions: () =>
        new Map(Object.entries({ a: [0, 0], b: direction === "right" ? [316, 0] : [0, 212] })),
      sizes: () => new Map(),
    }) as unknown as EditorContext;
  expect(freePosition(standing("right"))).toEqual([316, 136]);
  expect(freePosition(standing("down"))).toEqual([240, 212]);
  // An exit that nobody has placed stands behind the last card: it makes way.
  const ended = (exitPosition: [number, number] | null) =>
    ({
      ...standing("right"),
      graph: { ...EMPTY_GRAPH, direction: "right", exitPosition, actions: [{ key: "a" }] },
      positions: () => new Map(Object.entries({ a: [0, 0], exit: exitPosition ?? [272, 36] })),
    }) as unknown as EditorContext;
  expect(freePosition(ended(null))).toEqual([316, 0]);
  expect(freePosition(ended([320, 36]))).toEqual([316, 172]);
});
