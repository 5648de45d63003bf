/** Edit actions that draw: add, copy, paste, delete, connect. */
import {
  IconArrowBackUp,
  IconArrowForwardUp,
  IconArrowsSplit2,
  IconBandage,
  IconClipboardPlus,
  IconCopy,
  IconCopyPlus,
  IconCut,
  IconFlag,
  IconLine,
  IconPackageExport,
  IconPackageImport,
  IconPlayerPlay,
  IconPlus,
  IconRotateClockwise,
  IconRouteAltRight,
  IconSquareCheck,
  IconSquareX,
  IconTrash,
} from "@tabler/icons-react";
import { relationId } from "../graph/document-keys";
import {
  asOneEdit,
  removeActions,
  removeNotes,
  removeRelations,
  setEntry,
  setExit,
  unsetEntry,
  unsetExit,
} from "../graph/edit";
import { clipOf, paste } from "../graph/edit/clip";
import { straighten } from "../graph/edit/waypoints";
import { type Action, ENTRY, EXIT, type Key } from "../graph/model";
import { isBent } from "../graph/waypoints";
import { copyText } from "../ui/copy-text";
import { copiedSelection, pasteText, readText, rememberCopied } from "./clipboard";
import type { EditAction } from "./edit-action";
import {
  type EditorContext,
  selectedActions,
  selectedNotes,
  selectedRelations,
} from "./editor-context";
import { chosenGraph } from "./view";

const always = () => true;
const anyAction = (context: EditorContext) => context.graph.actions.length > 0;
const someAction = (context: EditorContext) => selectedActions(context).length > 0;
const something = (context: EditorContext) =>
  selectedActions(context).length + selectedNotes(context).length > 0;

export const add: EditAction = {
  name: "add",
  label: "Add an action",
  group: "Draw",
  shortcuts: ["a"],
  icon: IconPlus,
  changes: true,
  also: "new node insert",
  enabled: always,
  run: (context) => context.openAdd(),
};

export const copy: EditAction = {
  name: "copy",
  label: "Copy",
  group: "Draw",
  shortcuts: ["Mod+c"],
  icon: IconCopy,
  changes: false,
  event: "copy",
  also: "UMRF text clipboard",
  enabled: something,
  run: (context) => {
    const held = copiedSelection(context);
    rememberCopied(held);
    void copyText(held.text);
  },
};

export const cut: EditAction = {
  name: "cut",
  label: "Cut",
  group: "Draw",
  shortcuts: ["Mod+x"],
  icon: IconCut,
  changes: true,
  event: "cut",
  enabled: something,
  run: (context) => {
    copy.run(context);
    removeSelection.run(context);
  },
};

export const pasteHere: EditAction = {
  name: "paste",
  label: "Paste",
  group: "Draw",
  shortcuts: ["Mod+v"],
  icon: IconClipboardPlus,
  changes: true,
  event: "paste",
  also: "UMRF text clipboard",
  enabled: always,
  run: (context) => void readText().then((text) => pasteText(context, text)),
};

export const duplicate: EditAction = {
  name: "duplicate",
  label: "Duplicate",
  group: "Draw",
  shortcuts: ["Mod+d"],
  icon: IconCopyPlus,
  changes: true,
  enabled: something,
  run: (context) => {
    const clip = clipOf(context.doc, context.selection, context.positions());
    const keys = paste(context.doc, clip, { by: [40, 40] });
    context.select(keys);
    if (keys[0] !== undefined) context.view.focus(keys[0]);
  },
};

/** The chosen actions that are in the graph, by key. */
const chosenKeys = (context: EditorContext): Key[] =>
  selectedActions(context).flatMap(({ key, missing }) => (missing ? [] : [key]));

export const duplicateWith: EditAction = {
  name: "duplicate-with",
  label: "Duplicate with …",
  group: "Draw",
  shortcuts: [],
  icon: IconCopyPlus,
  changes: true,
  also: "copies series values list robot repeat",
  enabled: (context) => chosenKeys(context).length > 0,
  idle: "Choose the actions first.",
  run: (context) => context.openOverlay({ kind: "copies", actions: chosenKeys(context) }),
};

export const tryAgain: EditAction = {
  name: "try-again",
  label: "Try again …",
  group: "Draw",
  shortcuts: [],
  icon: IconRotateClockwise,
  changes: true,
  also: "retry attempts repeat error fails",
  enabled: (context) => chosenKeys(context).length === 1,
  idle: "Choose an action first.",
  run: (context) => {
    const [action] = chosenKeys(context);
    if (action) context.openOverlay({ kind: "tries", action });
  },
};

export const removeSelection: EditAction = {
  name: "remove",
  label: "Delete",
  group: "Draw",
  shortcuts: ["Delete", "Backspace"],
  icon: IconTrash,
  changes: true,
  enabled: (context) => something(context) || selectedRelations(context).length > 0,
  run: (context) => {
    const actions = selectedActions(context).map((action) => action.key);
    const relations = selectedRelations(context).map(relationId);
    asOneEdit(context.doc, () => {
      removeRelations(context.doc, relations);
      removeActions(context.doc, actions);
      removeNotes(
        context.doc,
        selectedNotes(context).map((key) => key.slice(2)),
      );
    });
    context.select([]);
  },
};

export const removeAndReconnect: EditAction = {
  name: "heal",
  label: "Delete and heal",
  group: "Draw",
  shortcuts: ["Mod+Backspace", "Mod+Delete"],
  icon: IconBandage,
  changes: true,
  also: "remove reconnect close the gap",
  enabled: someAction,
  run: (context) => {
    const actions = selectedActions(context).map((action) => action.key);
    removeActions(context.doc, actions, { heal: true });
    context.select([]);
  },
};

export const extract: EditAction = {
  name: "extract",
  label: "Make a sub-graph of these …",
  group: "Draw",
  shortcuts: ["Mod+g"],
  icon: IconPackageImport,
  changes: true,
  also: "extract group hierarchy level inside",
  enabled: (context) => selectedActions(context).some(({ missing }) => !missing),
  idle: "Choose the actions first.",
  run: (context) => {
    const actions = selectedActions(context).map(({ key }) => key);
    context.openOverlay({ kind: "extract", actions });
  },
};

export const unpack: EditAction = {
  name: "unpack",
  label: "Unpack the sub-graph",
  group: "Draw",
  shortcuts: ["Mod+Shift+g"],
  icon: IconPackageExport,
  changes: true,
  also: "ungroup inline hierarchy level dissolve",
  enabled: (context) => chosenGraph(context) !== null,
  idle: "Choose an action that stands for a graph first.",
  run: (context) => {
    const action = chosenGraph(context);
    if (action) context.openOverlay({ kind: "unpack", action: action.key });
  },
};

export const undo: EditAction = {
  name: "undo",
  label: "Undo",
  group: "Draw",
  shortcuts: ["Mod+z"],
  icon: IconArrowBackUp,
  changes: true,
  enabled: (context) => context.canUndo,
  idle: "You have no change to undo.",
  run: (context) => context.undo.undo(),
};

export const redo: EditAction = {
  name: "redo",
  label: "Redo",
  group: "Draw",
  shortcuts: ["Mod+Shift+z", "Mod+y"],
  icon: IconArrowForwardUp,
  changes: true,
  enabled: (context) => context.canRedo,
  idle: "There is nothing to redo.",
  run: (context) => context.undo.redo(),
};

export const selectAll: EditAction = {
  name: "select-all",
  label: "Select all",
  group: "Draw",
  shortcuts: ["Mod+a"],
  icon: IconSquareCheck,
  changes: false,
  enabled: anyAction,
  run: (context) => {
    const notes = context.graph.notes.map(([id]) => `g/${id}`);
    context.select([ENTRY, EXIT, ...context.graph.actions.map(({ key }) => key), ...notes]);
  },
};

export const selectNone: EditAction = {
  name: "select-none",
  label: "Select nothing",
  group: "Draw",
  shortcuts: ["Escape"],
  icon: IconSquareX,
  changes: false,
  enabled: always,
  run: (context) => {
    if (context.selection.size > 0 || context.past === null) context.select([]);
    else context.lookAt(null);
  },
};

/** Returns the action from which a chain goes on: the end of the one arrow that is selected, as after drawing it. */
function drawnLast(context: EditorContext): Key | null {
  const [arrow, ...others] = selectedRelations(context);
  if (arrow === undefined || others.length > 0) return null;
  return arrow.child === EXIT ? arrow.parent : arrow.child;
}

export const connectTo: EditAction = {
  name: "connect",
  label: "Draw an arrow …",
  group: "Draw",
  shortcuts: ["c"],
  icon: IconArrowsSplit2,
  changes: true,
  also: "connect link edge relation",
  enabled: anyAction,
  run: (context) => {
    const [first, ...others] = selectedActions(context);
    const from = context.selection.has(ENTRY) ? ENTRY : (first?.key ?? drawnLast(context));
    const to = context.selection.has(EXIT) ? EXIT : (others[0]?.key ?? null);
    context.openOverlay({ kind: "arrow", from, to });
  },
};

export const retargetArrow: EditAction = {
  name: "retarget",
  label: "Lead the arrow elsewhere …",
  group: "Draw",
  shortcuts: ["r"],
  icon: IconRouteAltRight,
  changes: true,
  also: "retarget reconnect redirect edge",
  enabled: (context) => selectedRelations(context).length === 1,
  run: (context) => {
    const [relation] = selectedRelations(context);
    if (relation) context.openOverlay({ kind: "retarget", relation: relationId(relation) });
  },
};

export const straightenLine: EditAction = {
  name: "straighten",
  label: "Straighten the line",
  group: "Draw",
  shortcuts: [],
  icon: IconLine,
  changes: true,
  also: "remove bends waypoints unbend reset route",
  enabled: (context) => selectedRelations(context).some(isBent),
  run: (context) => straighten(context.doc, selectedRelations(context)),
};

/** Ties all that are chosen to one end, or unties them when all of them are. */
function toggleEnd(context: EditorContext, end: typeof ENTRY | typeof EXIT): void {
  const tied = (action: Action) =>
    context.graph.relations.some((relation) =>
      end === ENTRY
        ? relation.parent === ENTRY && relation.child === action.key
        : relation.parent === action.key && relation.child === EXIT,
    );
  const actions = selectedActions(context);
  const all = actions.every(tied);
  asOneEdit(context.doc, () => {
    for (const { key } of actions) {
      if (end === ENTRY) all ? unsetEntry(context.doc, key) : setEntry(context.doc, key);
      else if (all) unsetExit(context.doc, key);
      else setExit(context.doc, key);
    }
  });
}

export const entry: EditAction = {
  name: "entry",
  label: "Start with this",
  group: "Draw",
  shortcuts: ["e"],
  icon: IconPlayerPlay,
  changes: true,
  also: "entry begin first",
  enabled: someAction,
  run: (context) => toggleEnd(context, ENTRY),
};

export const exit: EditAction = {
  name: "exit",
  label: "End with this",
  group: "Draw",
  shortcuts: ["x"],
  icon: IconFlag,
  changes: true,
  also: "exit last finish",
  enabled: someAction,
  run: (context) => toggleEnd(context, EXIT),
};
