/** Bends lines and leads arrows or single outcomes to other actions. */
import { notifications } from "@mantine/notifications";
import { useMemo } from "react";
import { pillWord } from "../../canvas/arrows/bundles";
import type { LineEditing } from "../../canvas/arrows/line-store";
import type { PlaceMap } from "../../canvas/editor-store";
import { nodeAt } from "../../canvas/hit-test";
import { type EditorContext, nudging } from "../../edit-actions/editor-context";
import { moveRelation, retarget } from "../../graph/edit";
import { setWaypoints } from "../../graph/edit/waypoints";
import type { Key, Precondition } from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { useStableCallback } from "../../ui/hooks";

/**
 * Leads an arrow from or to another action, and says so if that is impossible. `outcome`: moves
 * only this one; null: all of them.
 */
export function leadElsewhere(
  { doc, select }: Pick<EditorContext, "doc" | "select">,
  relation: string,
  outcome: Precondition | null,
  to: { readonly parent?: Key; readonly child?: Key },
): void {
  const moved = outcome ? retarget(doc, relation, outcome, to) : moveRelation(doc, relation, to);
  if (moved !== null) select([moved]);
  else {
    notifications.show({
      color: "red",
      title: "The arrow was not moved",
      message: "These two are already connected, or no arrow can end there.",
    });
  }
}

/**
 * Return the functions that bend lines and move outcomes; null if the person may not edit.
 * `toDocument`: maps drawn places to places in the document.
 */
export function useLineEditing(context: EditorContext, toDocument: PlaceMap): LineEditing | null {
  const { mayEdit } = context;
  const bend = useStableCallback<Parameters<LineEditing["bend"]>, void>(
    (bundle, waypoints, byKey) => {
      const places = waypoints
        .map(toDocument)
        .map(([x, y]) => [Math.round(x), Math.round(y)] as const);
      const write = () => setWaypoints(context.doc, bundle.id, places);
      if (byKey) nudging(context, `bends ${bundle.id}`, write);
      else write();
    },
  );
  const nameOf = useStableCallback<Parameters<LineEditing["nameOf"]>, string>((bundle) => {
    const [from, to] = [bundle.source, bundle.target].map((key) => endName(context.graph, key));
    const word = pillWord(bundle);
    return `${from} → ${to}${word === "" ? "" : ` (${word})`}`;
  });
  // An outcome dropped on empty canvas, or on a card that its arrow connects already, stays.
  const drop = useStableCallback<Parameters<LineEditing["drop"]>, void>((bundle, outcome, at) => {
    const card = nodeAt(at);
    if (card === null || card === bundle.source || card === bundle.target) return;
    leadElsewhere(context, bundle.relation, outcome, { child: card });
  });
  const choose = useStableCallback<Parameters<LineEditing["choose"]>, void>((bundle, outcome) =>
    context.openOverlay({ kind: "retarget", relation: bundle.relation, outcome }),
  );
  return useMemo(
    () => (mayEdit ? { bend, nameOf, drop, choose } : null),
    [mayEdit, bend, nameOf, drop, choose],
  );
}
