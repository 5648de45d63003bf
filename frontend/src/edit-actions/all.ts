/** Every edit action, in the order in which menus and help list them. */
import { ALIGN, DISTRIBUTE, NUDGE, snap, tidy, tidySelection, turn } from "./arrange";
import * as breakpoints from "./breakpoints";
import * as draw from "./draw";
import { DRY_RUN } from "./dry-run-actions";
import type { EditAction } from "./edit-action";
import * as folding from "./folding";
import * as notes from "./notes";
import * as partial from "./partial-runs";
import * as graph from "./share";
import * as look from "./view";

export * from "./arrange";
export * from "./breakpoints";
export * from "./draw";
export * from "./folding";
export * from "./notes";
export * from "./partial-runs";
export * from "./share";
export * from "./view";

export const EDIT_ACTIONS: readonly EditAction[] = [
  draw.add,
  draw.connectTo,
  draw.retargetArrow,
  draw.straightenLine,
  notes.insert,
  breakpoints.breakpoint,
  draw.entry,
  draw.exit,
  notes.note,
  notes.frame,
  notes.write,
  notes.setRobot,
  draw.copy,
  draw.cut,
  draw.pasteHere,
  draw.duplicate,
  draw.duplicateWith,
  draw.tryAgain,
  draw.removeSelection,
  draw.removeAndReconnect,
  draw.extract,
  draw.unpack,
  draw.undo,
  draw.redo,
  draw.selectAll,
  draw.selectNone,
  tidy,
  tidySelection,
  turn,
  ...ALIGN,
  ...DISTRIBUTE,
  snap,
  ...NUDGE,
  look.palette,
  look.fit,
  look.zoomSelection,
  look.zoomIn,
  look.zoomOut,
  look.marquee,
  look.pan,
  ...look.WALK,
  folding.fold,
  folding.foldAll,
  folding.unfoldAll,
  look.enter,
  look.leave,
  look.expandGraph,
  look.expandMore,
  look.collapseGraphs,
  notes.details,
  look.toCanvas,
  look.menu,
  look.showJson,
  ...look.PANELS,
  look.showShortcuts,
  ...DRY_RUN,
  partial.runFrom,
  partial.runOnly,
  partial.dryRunFrom,
  partial.dryRunOnly,
  graph.exportUmrf,
  graph.exportSvg,
  graph.exportPng,
  graph.packages,
  graph.history,
  look.flatten,
  graph.print,
  graph.copyLink,
];
