/** The edit actions that ask for a run of a part of the graph. They open the look before a start. */
import { IconPlayerSkipForward, IconPlayerTrackNext } from "@tabler/icons-react";
import { fullName } from "../graph/model";
import type { EditAction } from "./edit-action";
import { type EditorContext, selectedActions } from "./editor-context";

/** Return the full names of the chosen actions; none while the past or a dry-run is shown. */
function chosen(context: EditorContext): string[] {
  if (!context.mayRun || context.past !== null || context.dryRun !== null) return [];
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
