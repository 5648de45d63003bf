/** Everything that can be done to a graph with one stroke. */
import {
  IconArrowBackUp,
  IconArrowForwardUp,
  IconBraces,
  IconCopyPlus,
  IconDownload,
  IconFocusCentered,
  IconHandStop,
  IconLayoutDistributeVertical,
  IconMarquee2,
  IconPlus,
  IconSelectAll,
  IconTrash,
  IconZoomIn,
  IconZoomOut,
} from "@tabler/icons-react";
import { addAction, moveActions, removeActions, removeRelations, together } from "../../graph/edit";
import { relationId } from "../../graph/layout";
import { ENTRY, EXIT } from "../../graph/model";
import { arrange } from "../../ui/canvas/arrange";
import { type Bench, selectedActions, selectedRelations } from "../bench";
import type { Deed } from "./deed";

const always = () => true;
const anyAction = (bench: Bench) => bench.graph.actions.length > 0;

export const add: Deed = {
  name: "add",
  label: "Add an action",
  shortcuts: ["a"],
  icon: IconPlus,
  changes: true,
  enabled: always,
  run: (bench) => bench.openAdd(),
};

export const remove: Deed = {
  name: "remove",
  label: "Delete",
  shortcuts: ["Delete", "Backspace"],
  icon: IconTrash,
  changes: true,
  enabled: (bench) => selectedActions(bench).length + selectedRelations(bench).length > 0,
  run: (bench) => {
    const actions = selectedActions(bench).map((action) => action.key);
    const relations = selectedRelations(bench).map(relationId);
    together(bench.doc, () => {
      removeRelations(bench.doc, relations);
      removeActions(bench.doc, actions);
    });
    bench.select([]);
  },
};

export const duplicate: Deed = {
  name: "duplicate",
  label: "Duplicate",
  shortcuts: ["Mod+d"],
  icon: IconCopyPlus,
  changes: true,
  enabled: (bench) => selectedActions(bench).length > 0,
  run: (bench) => {
    const places = bench.places();
    const keys = together(bench.doc, () =>
      selectedActions(bench).map((action) => {
        const [x, y] = places.get(action.key) ?? [0, 0];
        return addAction(bench.doc, {
          name: action.name,
          type: action.type,
          actor: action.actor,
          description: action.description,
          inputs: action.inputs,
          outputs: action.outputs,
          position: [x + 40, y + 40],
        });
      }),
    );
    bench.select(keys);
  },
};

export const undo: Deed = {
  name: "undo",
  label: "Undo",
  shortcuts: ["Mod+z"],
  icon: IconArrowBackUp,
  changes: true,
  enabled: (bench) => bench.canUndo,
  run: (bench) => bench.undo.undo(),
};

export const redo: Deed = {
  name: "redo",
  label: "Redo",
  shortcuts: ["Mod+Shift+z", "Mod+y"],
  icon: IconArrowForwardUp,
  changes: true,
  enabled: (bench) => bench.canRedo,
  run: (bench) => bench.undo.redo(),
};

export const tidy: Deed = {
  name: "tidy",
  label: "Tidy",
  shortcuts: ["Shift+t"],
  icon: IconLayoutDistributeVertical,
  changes: true,
  enabled: anyAction,
  run: (bench) => {
    moveActions(bench.doc, arrange(bench.graph, bench.sizes()));
    requestAnimationFrame(() => bench.view.fit());
  },
};

export const selectAll: Deed = {
  name: "select-all",
  label: "Select all",
  shortcuts: ["Mod+a"],
  icon: IconSelectAll,
  changes: false,
  enabled: anyAction,
  run: (bench) => bench.select([ENTRY, EXIT, ...bench.graph.actions.map((action) => action.key)]),
};

export const fit: Deed = {
  name: "fit",
  label: "Fit",
  shortcuts: ["f", "Shift+!"],
  icon: IconFocusCentered,
  changes: false,
  enabled: always,
  run: (bench) => bench.view.fit(),
};

export const zoomIn: Deed = {
  name: "zoom-in",
  label: "Zoom in",
  shortcuts: ["="],
  icon: IconZoomIn,
  changes: false,
  enabled: always,
  run: (bench) => bench.view.zoomIn(),
};

export const zoomOut: Deed = {
  name: "zoom-out",
  label: "Zoom out",
  shortcuts: ["-"],
  icon: IconZoomOut,
  changes: false,
  enabled: always,
  run: (bench) => bench.view.zoomOut(),
};

export const pan: Deed = {
  name: "pan",
  label: "Pan",
  shortcuts: ["h"],
  icon: IconHandStop,
  changes: false,
  enabled: always,
  run: (bench) => bench.setTool("pan"),
};

export const marquee: Deed = {
  name: "marquee",
  label: "Select",
  shortcuts: ["v"],
  icon: IconMarquee2,
  changes: false,
  enabled: always,
  run: (bench) => bench.setTool("select"),
};

export const showJson: Deed = {
  name: "json",
  label: "Show the JSON",
  shortcuts: ["j"],
  icon: IconBraces,
  changes: false,
  enabled: always,
  run: (bench) => bench.setPanel("json"),
};

export const exportUmrf: Deed = {
  name: "export",
  label: "Export as UMRF",
  shortcuts: ["Mod+s"],
  icon: IconDownload,
  changes: false,
  enabled: always,
  run: (bench) => bench.download(),
};

export const DEEDS: readonly Deed[] = [
  add,
  duplicate,
  remove,
  undo,
  redo,
  selectAll,
  tidy,
  fit,
  zoomIn,
  zoomOut,
  marquee,
  pan,
  showJson,
  exportUmrf,
];
