/** Another name for the open graph, and the question whether others that run it follow. */
import { usedIn, useLibrary } from "../api/library";
import { setGraphName } from "../graph/edit";
import { useWatched } from "../ui/watched";
import type { EditorContext } from "./editor-context";

type Here = Pick<EditorContext, "doc" | "graph" | "id" | "store" | "openOverlay">;

/**
 * Returns how to rename. The name is written at once, so that it is never lost; whoever runs the graph
 * by its old name is asked about then.
 */
export function useRenameGraph({
  doc,
  graph,
  id,
  store,
  openOverlay,
}: Here): (name: string) => true {
  const { data: actions = [] } = useLibrary();
  const stands = useWatched(store.graphsInside, (inside) => inside?.isNamed ?? false);
  return (name) => {
    const uses = stands ? usedIn(actions, { id, name: graph.name }) : [];
    setGraphName(doc, name);
    if (uses.length > 0 && name !== graph.name)
      openOverlay({ kind: "renamed", before: graph.name, name, uses });
    return true;
  };
}
