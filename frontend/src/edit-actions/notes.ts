/** Deeds with notes and frames, and those that open what is chosen. */
import {
  IconFrame,
  IconLayoutSidebarRight,
  IconNote,
  IconPencil,
  IconRowInsertBottom,
} from "@tabler/icons-react";
import { CARD } from "../canvas/geometry/arrange";
import { relationId } from "../graph/document-keys";
import { writeNote } from "../graph/edit/notes";
import type { Deed } from "./edit-action";
import { type Bench, selectedNotes, selectedRelations } from "./editor-context";

const SIZE = [200, 84] as const; // px of a new note
const AIR = 28; // px between a frame and what lies in it

export const note: Deed = {
  name: "note",
  label: "Write a note",
  group: "Draw",
  shortcuts: ["n"],
  icon: IconNote,
  changes: true,
  also: "sticky comment text",
  enabled: () => true,
  run: (bench) => {
    const [x, y] = bench.view.pointer()?.at ?? bench.view.middle();
    const at = [x - SIZE[0] / 2, y - SIZE[1] / 2] as const;
    const key = writeNote(bench.doc, { kind: "note", at, size: SIZE, text: "", color: "amber" });
    bench.select([key]);
    bench.open({ kind: "note", key });
  },
};

/** Round what is chosen, else round the middle of the view. */
function boxOf(bench: Bench): { at: readonly [number, number]; size: readonly [number, number] } {
  const [places, sizes] = [bench.places(), bench.sizes()];
  const boxes = [...bench.selection].flatMap((key) => {
    const at = places.get(key);
    const { width, height } = sizes.get(key) ?? CARD;
    return at ? [[at[0], at[1], at[0] + width, at[1] + height] as const] : [];
  });
  if (boxes.length === 0) {
    const [x, y] = bench.view.middle();
    return { at: [x - 200, y - 40], size: [400, 280] };
  }
  const left = Math.min(...boxes.map((box) => box[0])) - AIR;
  const top = Math.min(...boxes.map((box) => box[1])) - AIR;
  const right = Math.max(...boxes.map((box) => box[2])) + AIR;
  const bottom = Math.max(...boxes.map((box) => box[3])) + AIR;
  return { at: [left, top], size: [right - left, bottom - top] };
}

export const frame: Deed = {
  name: "frame",
  label: "Draw a frame",
  group: "Draw",
  shortcuts: ["Shift+f"],
  icon: IconFrame,
  changes: true,
  also: "group section box round the selection",
  enabled: () => true,
  run: (bench) => {
    const { at, size } = boxOf(bench);
    const key = writeNote(bench.doc, { kind: "frame", at, size, text: "", color: "blue" });
    bench.select([key]);
    bench.open({ kind: "note", key });
  },
};

export const write: Deed = {
  name: "write",
  label: "Write the text",
  group: "Draw",
  shortcuts: ["Enter"],
  icon: IconPencil,
  changes: true,
  also: "edit note title",
  enabled: (bench) => bench.selection.size === 1 && selectedNotes(bench).length === 1,
  run: (bench) => {
    const [key] = selectedNotes(bench);
    if (key !== undefined) bench.open({ kind: "note", key });
  },
};

export const details: Deed = {
  name: "details",
  label: "Open the details",
  group: "Look",
  shortcuts: ["Shift+Enter"],
  icon: IconLayoutSidebarRight,
  changes: false,
  also: "parameters properties form",
  enabled: () => true,
  run: (bench) => {
    bench.setPanel("details");
    // Where the panel slides in, it cannot have the focus before it is seen.
    setTimeout(() => {
      const panel = document.querySelector(
        '[aria-label="Details"] [role="tabpanel"]:not([hidden])',
      );
      const field = panel?.querySelector<HTMLElement>("input, textarea");
      (field ?? panel?.querySelector<HTMLElement>("button"))?.focus();
    }, 60);
  },
};

export const insert: Deed = {
  name: "insert",
  label: "Insert an action into the arrow",
  group: "Draw",
  shortcuts: ["i"],
  icon: IconRowInsertBottom,
  changes: true,
  also: "splice between",
  enabled: (bench) => selectedRelations(bench).length === 1,
  run: (bench) => {
    const [relation] = selectedRelations(bench);
    if (!relation) return;
    const [a, b] = [relation.parent, relation.child].map((key) => bench.places().get(key));
    const [x, y] =
      a && b ? [(a[0] + b[0] + CARD.width) / 2, (a[1] + b[1]) / 2] : bench.view.middle();
    const at = [Math.round(x), Math.round(y)] as const;
    bench.openAdd({ screen: bench.view.screenOf(at), at, from: null, into: relationId(relation) });
  },
};
