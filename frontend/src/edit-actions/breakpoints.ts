/** The edit action that sets breakpoints, and takes them away. */
import { IconHandStop } from "@tabler/icons-react";
import { PLAIN, readBreakpoint, whyNoBreakpoint } from "../graph/breakpoints";
import { relationId } from "../graph/document-keys";
import { asOneEdit } from "../graph/edit";
import { setBreakpoint } from "../graph/edit/breakpoints";
import type { EditAction } from "./edit-action";
import { type EditorContext, selectedActions, selectedRelations } from "./editor-context";

/** Return what is chosen and can have a breakpoint, with whether it has one. */
function places(context: EditorContext): { id: string; has: boolean }[] {
  const has = (text: string | undefined) => readBreakpoint(text) !== null;
  return [
    ...selectedActions(context)
      .filter(({ missing }) => !missing)
      .map(({ key, breakpoint }) => ({ id: key, has: has(breakpoint) })),
    ...selectedRelations(context)
      .filter((relation) => relation.breakpoint !== undefined || whyNoBreakpoint(relation) === null)
      .map((relation) => ({ id: relationId(relation), has: has(relation.breakpoint) })),
  ];
}

export const breakpoint: EditAction = {
  name: "breakpoint",
  label: "Set or remove a breakpoint",
  group: "Draw",
  shortcuts: ["F9", "Shift+b"],
  icon: IconHandStop,
  changes: true,
  also: "wait before hold debug pause",
  enabled: (context) => places(context).length > 0,
  idle: "Choose an action first, or an arrow by which something begins: a stop always passes.",
  run: (context) => {
    const found = places(context);
    const all = found.every(({ has }) => has);
    asOneEdit(context.doc, () => {
      for (const { id, has } of found)
        if (all || !has) setBreakpoint(context.doc, id, all ? null : PLAIN);
    });
  },
};
