/** Edit actions for notes and frames, and those that open what is chosen. */
import {
  IconFrame,
  IconLayoutSidebarRight,
  IconNote,
  IconPencil,
  IconRobot,
  IconRowInsertBottom,
} from "@tabler/icons-react";
import { CARD } from "../canvas/geometry/ranks";
import { relationId } from "../graph/document-keys";
import { writeNote } from "../graph/edit/notes";
import { EXIT } from "../graph/model";
import { whenThere } from "../ui/focus-field";
import type { EditAction } from "./edit-action";
import {
  type EditorContext,
  freeFrom,
  selectedActions,
  selectedNotes,
  selectedRelations,
} from "./editor-context";

const SIZE = [200, 84] as const; // px of a new note
const AIR = 28; // px between a frame and what lies in it

export const note: EditAction = {
  name: "note",
  label: "Write a note",
  group: "Draw",
  shortcuts: ["n"],
  icon: IconNote,
  changes: true,
  also: "sticky comment text",
  enabled: () => true,
  run: (context) => {
    const [x, y] = context.view.pointer()?.at ?? context.view.middle();
    const at = [x - SIZE[0] / 2, y - SIZE[1] / 2] as const;
    const key = writeNote(context.doc, { kind: "note", at, size: SIZE, text: "", color: "amber" });
    context.select([key]);
    context.openOverlay({ kind: "note", key });
  },
};

/** Round what is chosen, else round the middle of the view. */
function boxOf(context: EditorContext): {
  at: readonly [number, number];
  size: readonly [number, number];
} {
  const [places, sizes] = [context.positions(), context.sizes()];
  const boxes = [...context.selection].flatMap((key) => {
    const at = places.get(key);
    const { width, height } = sizes.get(key) ?? CARD;
    return at ? [[at[0], at[1], at[0] + width, at[1] + height] as const] : [];
  });
  if (boxes.length === 0) {
    const [x, y] = context.view.middle();
    return { at: [x - 200, y - 40], size: [400, 280] };
  }
  const left = Math.min(...boxes.map((box) => box[0])) - AIR;
  const top = Math.min(...boxes.map((box) => box[1])) - AIR;
  const right = Math.max(...boxes.map((box) => box[2])) + AIR;
  const bottom = Math.max(...boxes.map((box) => box[3])) + AIR;
  return { at: [left, top], size: [right - left, bottom - top] };
}

export const frame: EditAction = {
  name: "frame",
  label: "Draw a frame",
  group: "Draw",
  shortcuts: ["Shift+f"],
  icon: IconFrame,
  changes: true,
  also: "group section box round the selection",
  enabled: () => true,
  run: (context) => {
    const { at, size } = boxOf(context);
    const key = writeNote(context.doc, { kind: "frame", at, size, text: "", color: "blue" });
    context.select([key]);
    context.openOverlay({ kind: "note", key });
  },
};

export const write: EditAction = {
  name: "write",
  label: "Write the text",
  group: "Draw",
  shortcuts: ["Enter"],
  icon: IconPencil,
  changes: true,
  also: "edit note title",
  enabled: (context) => context.selection.size === 1 && selectedNotes(context).length === 1,
  run: (context) => {
    const [key] = selectedNotes(context);
    if (key !== undefined) context.openOverlay({ kind: "note", key });
  },
};

/** Return the `data-form` of the form that shows the selection; null if several things without actions are selected. */
function formOfSelection(context: EditorContext): string | null {
  const chosen = [
    ...selectedNotes(context),
    ...selectedActions(context).map(({ key }) => key),
    ...selectedRelations(context).map(relationId),
  ];
  if (chosen.length > 1) return selectedActions(context).length > 0 ? "several" : null;
  return chosen[0] ?? (context.selection.has(EXIT) ? EXIT : "graph");
}

/**
 * Select the form of what is chosen once it is shown. A slow page shows the form of the selection
 * before for a moment: a field of that form would lose the keyboard again with it.
 */
const selectorOf = (form: string) =>
  `[aria-label="Details"] [data-form="${CSS.escape(form)}"]:not([style*="display: none"])`;
const PATIENCE = 300; // frames, some seconds, for a form that has to be loaded first
const TYPED_IN = "input, textarea, [contenteditable=true]";

/** Gives the focus to the first field of a form, unless the person types in another field than `before` by now. */
function focusFirst(form: HTMLElement, before: Element | null): void {
  const now = document.activeElement;
  if (now !== before && now?.matches(TYPED_IN)) return;
  const field = form.querySelector<HTMLElement>("input, textarea");
  (field ?? form.querySelector<HTMLElement>("button"))?.focus();
}

export const details: EditAction = {
  name: "details",
  label: "Open the details",
  group: "Look",
  shortcuts: ["Shift+Enter"],
  icon: IconLayoutSidebarRight,
  changes: false,
  also: "parameters properties form",
  enabled: () => true,
  run: (context) => {
    context.setPanel("details");
    const before = document.activeElement;
    const chosen = formOfSelection(context);
    if (chosen === null) return;
    const form = selectorOf(chosen);
    // A panel that slides in cannot have the focus before it is visible.
    setTimeout(() => whenThere(form, (found) => focusFirst(found, before), PATIENCE), 60);
  },
};

export const setRobot: EditAction = {
  name: "robot",
  label: "Set the robot",
  group: "Draw",
  shortcuts: [],
  icon: IconRobot,
  changes: true,
  also: "actor whose owner performer",
  enabled: (context) => selectedActions(context).some(({ missing }) => !missing),
  idle: "Choose the actions first.",
  run: (context) => {
    context.setPanel("details");
    const form = selectorOf(formOfSelection(context) ?? "");
    const field = `${form} [data-robot-field]`;
    const before = document.activeElement;
    setTimeout(() => whenThere(field, (found) => focusFirst(found, before), PATIENCE), 60);
  },
};

export const insert: EditAction = {
  name: "insert",
  label: "Insert an action into the arrow",
  group: "Draw",
  shortcuts: ["i"],
  icon: IconRowInsertBottom,
  changes: true,
  also: "splice between",
  enabled: (context) => selectedRelations(context).length === 1,
  run: (context) => {
    const [relation] = selectedRelations(context);
    if (!relation) return;
    const [a, b] = [relation.parent, relation.child].map((key) => context.positions().get(key));
    const [x, y] =
      a && b ? [(a[0] + b[0] + CARD.width) / 2, (a[1] + b[1]) / 2] : context.view.middle();
    // Between two that stand close it goes beside the arrow.
    const [left, top] = freeFrom(context, [x - CARD.width / 2, y]);
    const at = [Math.round(left + CARD.width / 2), Math.round(top)] as const;
    context.openAdd({
      screen: context.view.screenOf(at),
      at,
      from: null,
      into: relationId(relation),
    });
  },
};
