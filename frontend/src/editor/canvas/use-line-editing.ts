/** How lines are bent, and outcomes led elsewhere, on the canvas itself; null for who may not edit. */
import { useMemo } from "react";
import { pillWord } from "../../canvas/arrows/bundles";
import type { LineEditing } from "../../canvas/arrows/line-store";
import type { PlaceMap } from "../../canvas/folding/spread";
import { type EditorContext, nudging } from "../../edit-actions/editor-context";
import { setWaypoints } from "../../graph/edit/waypoints";
import { endName } from "../../graph/relation-words";
import { useStableCallback } from "../../ui/hooks/use-stable-callback";
import { nodeAt } from "./hit-test";
import { leadElsewhere } from "./lead-elsewhere";

/** `toDocument`: where something stands that is drawn there. */
export function useLineEditing(context: EditorContext, toDocument: PlaceMap): LineEditing | null {
  const { mayEdit } = context;
  const bend = useStableCallback<Parameters<LineEditing["bend"]>, void>((bundle, via, byKey) => {
    const places = via.map(toDocument).map(([x, y]) => [Math.round(x), Math.round(y)] as const);
    const write = () => setWaypoints(context.doc, bundle.id, places);
    if (byKey) nudging(context, `bends ${bundle.id}`, write);
    else write();
  });
  const nameOf = useStableCallback<Parameters<LineEditing["nameOf"]>, string>((bundle) => {
    const [from, to] = [bundle.source, bundle.target].map((key) => endName(context.graph, key));
    const word = pillWord(bundle);
    return `${from} → ${to}${word === "" ? "" : ` (${word})`}`;
  });
  // As where a new arrow is drawn: on nothing, or on the cards it ties already, it stays.
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
