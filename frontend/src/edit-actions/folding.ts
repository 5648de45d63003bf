/** Edit actions that fold frames. Folding is part of the view; the graph is not changed. */
import { IconFold } from "@tabler/icons-react";
import { framesOf } from "../canvas/folding/folding";
import { announcer } from "../ui/announcer";
import { counted } from "../words/counted";
import type { EditAction } from "./edit-action";
import type { EditorContext } from "./editor-context";

const look = {
  group: "Look",
  changes: false,
  also: "collapse expand hide contents frame",
} as const;

const chosenFrames = (context: EditorContext): string[] =>
  context.selection.size === 0
    ? []
    : framesOf(context.graph).flatMap(({ key }) => (context.selection.has(key) ? [key] : []));

const framesThat = (context: EditorContext, folded: boolean): string[] =>
  framesOf(context.graph).flatMap(({ key }) => (context.folded.has(key) === folded ? [key] : []));

/** The keyboard stays at the frame, which is chosen alone: nothing that is hidden stays chosen. */
export function foldFrames(context: EditorContext, keys: readonly string[], folded: boolean): void {
  const [first] = keys;
  if (first === undefined) return;
  context.fold(keys, folded);
  if (folded) context.select(keys);
  context.view.focus(first);
  announcer.say(folded ? "Folded" : "Unfolded");
}

/** Folds or unfolds every frame. Folding clears the selection, since parts of it may be hidden. */
function foldEvery(context: EditorContext, folded: boolean): void {
  const keys = framesThat(context, !folded);
  context.fold(keys, folded);
  if (folded) context.select([]);
  announcer.say(`${counted(keys.length, "frame")} ${folded ? "folded" : "unfolded"}`);
}

export const fold: EditAction = {
  ...look,
  name: "fold",
  label: "Fold or unfold the frame",
  shortcuts: ["b"],
  icon: IconFold,
  enabled: (context) => chosenFrames(context).length > 0,
  idle: "Choose a frame first.",
  run: (context) => {
    const chosen = chosenFrames(context);
    const open = chosen.filter((key) => !context.folded.has(key));
    if (open.length > 0) foldFrames(context, open, true);
    else foldFrames(context, chosen, false);
  },
};

export const foldAll: EditAction = {
  ...look,
  name: "fold-all",
  label: "Fold all frames",
  shortcuts: [],
  icon: IconFold,
  enabled: (context) => framesThat(context, false).length > 0,
  run: (context) => foldEvery(context, true),
};

export const unfoldAll: EditAction = {
  ...look,
  name: "unfold-all",
  label: "Unfold all frames",
  shortcuts: [],
  icon: IconFold,
  enabled: (context) => framesThat(context, true).length > 0,
  run: (context) => foldEvery(context, false),
};
