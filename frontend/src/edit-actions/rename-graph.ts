/** Another name for the open graph, and the question whether others that run it follow. */
import { useSyncExternalStore } from "react";
import { useLibrary } from "../api/library";
import { graphsInside, usedIn } from "../canvas/graphs-inside";
import { setGraphName } from "../graph/edit";
import type { EditorContext } from "./editor-context";

type Here = Pick<EditorContext, "doc" | "graph" | "id" | "openOverlay">;

/**
 * Returns how to rename. The name is written at once, so that it is never lost; whoever runs the graph
 * by its old name is asked about then.
 */
export function useRenameGraph({ doc, graph, id, openOverlay }: Here): (name: string) => true {
  const { data: actions = [] } = useLibrary();
  const { subscribe, now } = graphsInside;
  const stands = useSyncExternalStore(subscribe, () => now()?.isNamed ?? false);
  return (name) => {
    const uses = stands ? usedIn(actions, { id, name: graph.name }) : [];
    setGraphName(doc, name);
    if (uses.length > 0 && name !== graph.name)
      openOverlay({ kind: "renamed", before: graph.name, name, uses });
    return true;
  };
}
