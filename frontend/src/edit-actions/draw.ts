/** Deeds that draw: add, copy, paste, delete, connect. */
import {
  IconArrowBackUp,
  IconArrowForwardUp,
  IconArrowsSplit2,
  IconBandage,
  IconClipboardPlus,
  IconCopy,
  IconCopyPlus,
  IconCut,
  IconDeselect,
  IconFlag,
  IconPlayerPlay,
  IconPlus,
  IconRouteAltRight,
  IconSelectAll,
  IconTrash,
} from "@tabler/icons-react";
import { relationId } from "../graph/document-keys";
import {
  removeActions,
  removeNotes,
  removeRelations,
  setEntry,
  setExit,
  together,
  unsetEntry,
  unsetExit,
} from "../graph/edit";
import { clipOf, paste } from "../graph/edit/clip";
import { type Action, ENTRY, EXIT } from "../graph/model";
import { copyText } from "../ui/copy-text";
import { copied, hold, pasteText, readText } from "./clipboard";
import type { Deed } from "./edit-action";
import { type Bench, selectedActions, selectedNotes, selectedRelations } from "./editor-context";

const always = () => true;
const anyAction = (bench: Bench) => bench.graph.actions.length > 0;
const someAction = (bench: Bench) => selectedActions(bench).length > 0;
const something = (bench: Bench) => selectedActions(bench).length + selectedNotes(bench).length > 0;

export const add: Deed = {
  name: "add",
  label: "Add an action",
  group: "Draw",
  shortcuts: ["a"],
  icon: IconPlus,
  changes: true,
  also: "new node insert",
  enabled: always,
  run: (bench) => bench.openAdd(),
};

export const copy: Deed = {
  name: "copy",
  label: "Copy",
  group: "Draw",
  shortcuts: ["Mod+c"],
  icon: IconCopy,
  changes: false,
  event: "copy",
  also: "UMRF text clipboard",
  enabled: something,
  run: (bench) => {
    const held = copied(bench);
    hold(held);
    void copyText(held.text);
  },
};

export const cut: Deed = {
  name: "cut",
  label: "Cut",
  group: "Draw",
  shortcuts: ["Mod+x"],
  icon: IconCut,
  changes: true,
  event: "cut",
  enabled: something,
  run: (bench) => {
    copy.run(bench);
    remove.run(bench);
  },
};

export const pasteHere: Deed = {
  name: "paste",
  label: "Paste",
  group: "Draw",
  shortcuts: ["Mod+v"],
  icon: IconClipboardPlus,
  changes: true,
  event: "paste",
  also: "UMRF text clipboard",
  enabled: always,
  run: (bench) => void readText().then((text) => pasteText(bench, text)),
};

export const duplicate: Deed = {
  name: "duplicate",
  label: "Duplicate",
  group: "Draw",
  shortcuts: ["Mod+d"],
  icon: IconCopyPlus,
  changes: true,
  enabled: something,
  run: (bench) => {
    const clip = clipOf(bench.doc, bench.selection, bench.places());
    const keys = paste(bench.doc, clip, { by: [40, 40] });
    bench.select(keys);
    if (keys[0] !== undefined) bench.view.focus(keys[0]);
  },
};

export const remove: Deed = {
  name: "remove",
  label: "Delete",
  group: "Draw",
  shortcuts: ["Delete", "Backspace"],
  icon: IconTrash,
  changes: true,
  enabled: (bench) => something(bench) || selectedRelations(bench).length > 0,
  run: (bench) => {
    const actions = selectedActions(bench).map((action) => action.key);
    const relations = selectedRelations(bench).map(relationId);
    together(bench.doc, () => {
      removeRelations(bench.doc, relations);
      removeActions(bench.doc, actions);
      removeNotes(bench.doc, selectedNotes(bench));
    });
    bench.select([]);
  },
};

export const heal: Deed = {
  name: "heal",
  label: "Delete and heal",
  group: "Draw",
  shortcuts: ["Mod+Backspace", "Mod+Delete"],
  icon: IconBandage,
  changes: true,
  also: "remove reconnect close the gap",
  enabled: someAction,
  run: (bench) => {
    const actions = selectedActions(bench).map((action) => action.key);
    removeActions(bench.doc, actions, { heal: true });
    bench.select([]);
  },
};

export const undo: Deed = {
  name: "undo",
  label: "Undo",
  group: "Draw",
  shortcuts: ["Mod+z"],
  icon: IconArrowBackUp,
  changes: true,
  enabled: (bench) => bench.canUndo,
  run: (bench) => bench.undo.undo(),
};

export const redo: Deed = {
  name: "redo",
  label: "Redo",
  group: "Draw",
  shortcuts: ["Mod+Shift+z", "Mod+y"],
  icon: IconArrowForwardUp,
  changes: true,
  enabled: (bench) => bench.canRedo,
  run: (bench) => bench.undo.redo(),
};

export const selectAll: Deed = {
  name: "select-all",
  label: "Select all",
  group: "Draw",
  shortcuts: ["Mod+a"],
  icon: IconSelectAll,
  changes: false,
  enabled: anyAction,
  run: (bench) => {
    const notes = bench.graph.notes.map(([id]) => `g/${id}`);
    bench.select([ENTRY, EXIT, ...bench.graph.actions.map(({ key }) => key), ...notes]);
  },
};

export const selectNone: Deed = {
  name: "select-none",
  label: "Select nothing",
  group: "Draw",
  shortcuts: ["Escape"],
  icon: IconDeselect,
  changes: false,
  enabled: always,
  run: (bench) => bench.select([]),
};

export const connectTo: Deed = {
  name: "connect",
  label: "Draw an arrow …",
  group: "Draw",
  shortcuts: ["c"],
  icon: IconArrowsSplit2,
  changes: true,
  also: "connect link edge relation",
  enabled: anyAction,
  run: (bench) => {
    const [first, ...others] = selectedActions(bench);
    const from = bench.selection.has(ENTRY) ? ENTRY : (first?.key ?? null);
    const to = bench.selection.has(EXIT) ? EXIT : (others[0]?.key ?? null);
    bench.open({ kind: "arrow", from, to });
  },
};

export const retarget: Deed = {
  name: "retarget",
  label: "Lead the arrow elsewhere …",
  group: "Draw",
  shortcuts: ["r"],
  icon: IconRouteAltRight,
  changes: true,
  also: "retarget reconnect redirect edge",
  enabled: (bench) => selectedRelations(bench).length === 1,
  run: (bench) => {
    const [relation] = selectedRelations(bench);
    if (relation) bench.open({ kind: "retarget", relation: relationId(relation) });
  },
};

/** Ties all that are chosen to one end, or unties them when all of them are. */
function toggleEnd(bench: Bench, end: typeof ENTRY | typeof EXIT): void {
  const tied = (action: Action) =>
    bench.graph.relations.some((relation) =>
      end === ENTRY
        ? relation.parent === ENTRY && relation.child === action.key
        : relation.parent === action.key && relation.child === EXIT,
    );
  const actions = selectedActions(bench);
  const all = actions.every(tied);
  together(bench.doc, () => {
    for (const { key } of actions) {
      if (end === ENTRY) all ? unsetEntry(bench.doc, key) : setEntry(bench.doc, key);
      else if (all) unsetExit(bench.doc, key);
      else setExit(bench.doc, key);
    }
  });
}

export const entry: Deed = {
  name: "entry",
  label: "Start with this",
  group: "Draw",
  shortcuts: ["e"],
  icon: IconPlayerPlay,
  changes: true,
  also: "entry begin first",
  enabled: someAction,
  run: (bench) => toggleEnd(bench, ENTRY),
};

export const exit: Deed = {
  name: "exit",
  label: "End with this",
  group: "Draw",
  shortcuts: ["x"],
  icon: IconFlag,
  changes: true,
  also: "exit last finish",
  enabled: someAction,
  run: (bench) => toggleEnd(bench, EXIT),
};
