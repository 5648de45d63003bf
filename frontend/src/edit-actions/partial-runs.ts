/** The edit actions that run a part of the graph. Those on robots open the look before a start. */
import { IconFlask, IconPlayerSkipForward, IconPlayerTrackNext } from "@tabler/icons-react";
import { fullName } from "../graph/model";
import type { EditAction } from "./edit-action";
import { type EditorContext, selectedActions } from "./editor-context";

/** Return the full names of the chosen actions, if the person may run them. */
const chosen = (context: EditorContext) => (context.mayRun ? named(context) : []);

/** Return the full names of the chosen actions; none while the past or a dry-run is shown. */
function named(context: EditorContext): string[] {
  if (context.past !== null || context.dryRun !== null) return [];
  return selectedActions(context)
    .filter(({ missing }) => !missing)
    .map(fullName);
}

export const runFrom: EditAction = {
  name: "run-from",
  label: "Run from here …",
  group: "Graph",
  shortcuts: [],
  icon: IconPlayerSkipForward,
  changes: false,
  also: "start continue resume middle action",
  enabled: (context) => chosen(context).length === 1,
  run: (context) => context.openOverlay({ kind: "begin", at: chosen(context), only: false }),
};

export const runOnly: EditAction = {
  name: "run-only",
  label: "Run only this …",
  group: "Graph",
  shortcuts: [],
  icon: IconPlayerTrackNext,
  changes: false,
  also: "start single these selection action",
  enabled: (context) => chosen(context).length > 0,
  run: (context) => context.openOverlay({ kind: "begin", at: chosen(context), only: true }),
};

export const dryRunFrom: EditAction = {
  name: "dry-run-from",
  label: "Dry-run from here",
  group: "Dry-run",
  shortcuts: [],
  icon: IconFlask,
  changes: false,
  also: "simulate middle action",
  enabled: (context) => named(context).length === 1,
  run: (context) => context.beginDryRun(null, {}, { at: named(context) }),
};

export const dryRunOnly: EditAction = {
  name: "dry-run-only",
  label: "Dry-run only this",
  group: "Dry-run",
  shortcuts: [],
  icon: IconFlask,
  changes: false,
  also: "simulate single these selection action",
  enabled: (context) => named(context).length > 0,
  run: (context) => context.beginDryRun(null, {}, { at: named(context), only: true }),
};
