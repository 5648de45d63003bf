/** Selects and shows what the address points at, once the graph is there and whenever the address changes. */
import { notifications } from "@mantine/notifications";
import { useEffect, useRef } from "react";
import { useSearch } from "wouter";
import type { EditorContext } from "../edit-actions/editor-context";
import { asksForHistory, present, targetOf, withPast } from "../edit-actions/graph-links";
import { shownKeys } from "../edit-actions/view";
import { focusField } from "../ui/focus-field";

const SETTLED = 160; // ms after which the canvas has measured its cards and shown the graph

/** Follows the address. `begun`: the graph has arrived and has places. */
export function useGraphLink(context: EditorContext, begun: boolean): void {
  // Moments of the past are in the address, too, and point at no element.
  const search = withPast(useSearch(), null);
  const now = useRef(context);
  now.current = context;
  useEffect(() => {
    if (begun && asksForHistory(search)) now.current.setPanel("history");
  }, [search, begun]);
  useEffect(() => {
    const target = begun ? targetOf(search) : null;
    if (target === null) return;
    const timer = setTimeout(() => {
      const { graph, select, setPanel } = now.current;
      const selection = present(graph, target.selection);
      if (selection.length < target.selection.length) {
        notifications.show({
          message: "The link points to something that is no longer in this graph.",
        });
      }
      select(selection);
      if (target.problem !== null) setPanel(selection.length > 0 ? "details" : "problems");
      // The selection is rendered first; then its place is known.
      requestAnimationFrame(() => {
        const keys = shownKeys(now.current);
        if (keys.length > 0) now.current.view.show(keys);
        const [only] = selection;
        if (only !== undefined && target.field !== null) focusField(`${only}|${target.field}`);
      });
    }, SETTLED);
    return () => clearTimeout(timer);
  }, [search, begun]);
}
