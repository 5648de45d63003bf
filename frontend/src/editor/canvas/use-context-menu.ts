/** Opens the context menu of the editor at the place of a right click or of a long press. */
import { arrowAt, nodeAt } from "../../canvas/hit-test";
import { useMenuPress } from "../../canvas/menu-press";
import type { EditorContext } from "../../edit-actions/editor-context";

/** Return the event handlers that open the menu for the element at a point, which is selected unless it is part
 * of the selection. */
export function useContextMenu(context: EditorContext) {
  return useMenuPress((screen) => {
    const target = nodeAt(screen) ?? arrowAt(screen);
    if (target === null) context.select([]);
    else if (!context.selection.has(target)) context.select([target]);
    context.openOverlay({ kind: "menu", screen });
    return true;
  });
}
