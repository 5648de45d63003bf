/** Where one is: the graphs, those around this one, this one, and what of it is chosen. */
import { NameOfGraph } from "../../canvas/graphs-inside";
import { addressAround, levelsOf } from "../../canvas/level-path";
import type { EditorContext } from "../../edit-actions/editor-context";
import { endName } from "../../graph/relation-words";
import type { Crumb } from "../../ui/top-bar";

export function crumbsOf(
  context: EditorContext,
  search: string,
  rename: (name: string) => boolean,
): Crumb[] {
  const [only, ...others] = context.selection;
  const action = context.graph.actions.find(({ key }) => key === only);
  return [
    { label: "Graphs", to: "/" },
    ...levelsOf(search).map(({ graph }, n) => ({
      label: <NameOfGraph id={graph} />,
      to: addressAround(search, n) ?? "/",
    })),
    {
      label: context.graph.name || "Untitled",
      ...(context.mayEdit && { rename }),
    },
    ...(action && others.length === 0
      ? [{ label: endName(context.graph, action.key), part: true }]
      : []),
  ];
}
