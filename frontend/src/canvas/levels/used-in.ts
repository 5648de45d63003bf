/** Which other graphs have an action that stands for a graph. */
import type { LibraryAction } from "../../api/documents/library";

/** By id. An action of the library comes first: then no graph is meant by the name. */
export function usedIn(
  actions: readonly LibraryAction[],
  graph: { readonly id: string; readonly name: string },
): readonly string[] {
  const found = actions.find(({ name, document }) => document === null && name === graph.name);
  return (found?.used_in ?? []).filter((each) => each !== graph.id);
}
