/** The keys of undo and redo where nothing else of the editor has keys. */
import { useEffect, useRef } from "react";
import { redo, undo } from "../../edit-actions/all";
import { editActionFor, isEnabled } from "../../edit-actions/edit-action";
import type { EditorContext } from "../../edit-actions/editor-context";

const TYPING = "input, textarea, select, [role=dialog], [role=menu]";

export function useUndoKeys(context: EditorContext): void {
  const now = useRef(context);
  now.current = context;
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (event.target instanceof Element && event.target.closest(TYPING) !== null) return;
      const editAction = editActionFor([undo, redo], event, false);
      if (editAction === null || !isEnabled(editAction, now.current)) return;
      event.preventDefault();
      editAction.run(now.current);
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
}
