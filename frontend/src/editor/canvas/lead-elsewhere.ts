/** Leads an arrow, or one of its outcomes alone, from or to another action; says so if it cannot. */
import { notifications } from "@mantine/notifications";
import type { EditorContext } from "../../edit-actions/editor-context";
import { moveRelation, retarget } from "../../graph/edit";
import type { Key, Precondition } from "../../graph/model";

/** `outcome`: the one that goes alone; null: all that the arrow says goes together. */
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
      title: "The arrow stays",
      message: "These two are tied already, or no arrow can lead there.",
    });
  }
}
