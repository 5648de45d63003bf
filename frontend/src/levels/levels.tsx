/** Keeps known which actions stand for graphs, and the way through which one came here. */
import { useEffect, useMemo } from "react";
import { useLocation, useSearch } from "wouter";
import { useGraphsAsActions, useLibrary } from "../api/documents/library";
import { graphsInside } from "../canvas/levels/graphs-inside";
import { addressAround, addressInside, levelsOf } from "../canvas/levels/level-path";
import { useEditorContext } from "../edit-actions/editor-context";
import { announcer } from "../ui/announcer";
import { useStableCallback } from "../ui/hooks/use-stable-callback";
import { InsideSign } from "./inside-sign";
import { useFlatLink } from "./use-flat-link";

const NONE: readonly never[] = [];

/** Graphs by the name of the actions that stand for them: engines look for an action of it first, of several
 * graphs of one name it is the oldest, which is listed first, and none stands for the graph that it is in. */
function useGraphsByName(id: string) {
  const { data: graphs = NONE } = useGraphsAsActions();
  const { data: actions = NONE } = useLibrary();
  return useMemo(() => {
    const ofLibrary = new Set(actions.flatMap(({ document, name }) => (document ? [name] : [])));
    const byName = new Map<string, string>();
    for (const { graph, name } of graphs)
      if (!ofLibrary.has(name) && !byName.has(name)) byName.set(name, graph);
    const names = new Map(graphs.map(({ graph, name }) => [graph, name]));
    const own = names.get(id);
    const isNamed = own !== undefined && byName.get(own) === id;
    if (own !== undefined) byName.delete(own);
    return { names, byName, isNamed };
  }, [graphs, actions, id]);
}

export function Levels() {
  const { id, graph } = useEditorContext();
  const [, go] = useLocation();
  const search = useSearch();
  useFlatLink();
  const { names, byName, isNamed } = useGraphsByName(id);
  const around = addressAround(search, levelsOf(search).length - 1);
  const enter = useStableCallback((action: string) => {
    const { name = "" } = graph.actions.find(({ key }) => key === action) ?? {};
    const inside = byName.get(name);
    if (inside === undefined) return;
    go(addressInside(search, { graph: id, action }, inside));
    announcer.say(`Inside ${name}`);
  });
  useEffect(() => {
    const leave = around === null ? null : () => go(around);
    graphsInside.set({ names, byName, isNamed, enter, leave, Sign: InsideSign });
    return () => graphsInside.set(null);
  }, [names, byName, isNamed, enter, around, go]);
  return null;
}
