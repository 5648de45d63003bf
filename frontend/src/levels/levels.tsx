/** Finds the graphs for which actions stand, and opens, expands and leaves them. */

import { IconArrowsDiagonal, IconStairsDown } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useCallback, useEffect, useMemo } from "react";
import { useLocation, useSearch } from "wouter";
import { refreshLibrary } from "../api/graphs";
import { useGraphsAsActions, useLibrary } from "../api/library";
import { type InnerStep, type InsideSignProps, useEditorStore } from "../canvas/editor-store";
import { addressAround, addressInside, type Level, levelsOf } from "../canvas/level-path";
import { useEditorContext } from "../edit-actions/editor-context";
import type { Graph } from "../graph/model";
import { announcer } from "../ui/announcer";
import { useStableCallback } from "../ui/hooks";
import { isolated } from "../words/isolated";
import { CardButton } from "./level-frame";
import style from "./levels.module.css";
import { NO_LEVELS, useExpansion } from "./use-expansion";

function InsideSign({ of, name }: InsideSignProps) {
  const { graphsInside } = useEditorStore();
  return (
    <span className={style.signs} data-signs>
      <CardButton
        small
        keys="}"
        label={`Expand the graph inside ${isolated(name)}`}
        Sign={IconArrowsDiagonal}
        onClick={() => graphsInside.now()?.expand.toggle(of)}
      />
      <CardButton
        small
        keys="]"
        label={`Open the graph inside ${isolated(name)}`}
        Sign={IconStairsDown}
        onClick={() => graphsInside.now()?.enter(of)}
      />
    </span>
  );
}

function useFlatLink(): void {
  const { openOverlay } = useEditorContext();
  const asked = new URLSearchParams(useSearch()).has("flat");
  const answer = useStableCallback(() => {
    openOverlay({ kind: "flat" });
    const answered = new URL(window.location.href);
    answered.searchParams.delete("flat");
    window.history.replaceState(window.history.state, "", answered);
  });
  useEffect(() => {
    if (asked) answer();
  }, [asked, answer]);
}

const NONE: readonly never[] = [];

/**
 * Return the ids of graphs by the name of the actions that stand for them. Actions of the library
 * come first, as in engines; of several graphs with one name the oldest counts, which is listed
 * first.
 */
function useGraphsByName() {
  const { data: graphs = NONE } = useGraphsAsActions();
  const { data: actions = NONE } = useLibrary();
  return useMemo(() => {
    const ofLibrary = new Set(actions.flatMap(({ document, name }) => (document ? [name] : [])));
    const all = new Map<string, string>();
    for (const { graph, name } of graphs)
      if (!ofLibrary.has(name) && !all.has(name)) all.set(name, graph);
    return { names: new Map(graphs.map(({ graph, name }) => [graph, name])), all };
  }, [graphs, actions]);
}

/**
 * Return the graphs for which actions of this graph can stand. An action with this graph's own name
 * stands for none.
 */
function useGraphsHere(id: string) {
  const { names, all } = useGraphsByName();
  return useMemo(() => {
    const byName = new Map(all);
    const own = names.get(id);
    const isNamed = own !== undefined && byName.get(own) === id;
    if (own !== undefined) byName.delete(own);
    return { names, byName, isNamed, idOf: (name: string) => all.get(name) };
  }, [names, all, id]);
}

/** Loads the library again when an action has an unknown name: somebody may have just made its graph. */
function useNewNames(names: readonly string[], byName: ReadonlyMap<string, string>): void {
  const client = useQueryClient();
  const { data: actions } = useLibrary();
  const fresh = useMemo(() => {
    const known = new Set(actions?.map(({ name }) => name));
    const unknown = names.filter((name) => !known.has(name) && !byName.has(name));
    return actions === undefined ? "" : [...new Set(unknown)].sort().join("\n");
  }, [actions, names, byName]);
  useEffect(() => {
    if (fresh !== "") void refreshLibrary(client);
  }, [fresh, client]);
}

const nameIn = (graph: Pick<Graph, "actions">, action: string): string =>
  graph.actions.find(({ key }) => key === action)?.name ?? "";

/**
 * Return a function that opens the graph for which an action stands; if it stands for none, the
 * graph that contains it. `path`: the expanded actions down to it.
 */
function useWayIn(byName: ReadonlyMap<string, string>) {
  const { id, graph, store } = useEditorContext();
  const [, go] = useLocation();
  const search = useSearch();
  return useStableCallback((path: string) => {
    const keys = path.split("/");
    const by: Level[] = [];
    let [here, at] = [id, graph as Pick<Graph, "actions">];
    let levels = store.expanded.now()?.levels ?? NO_LEVELS;
    for (const [n, action] of keys.entries()) {
      const name = nameIn(at, action);
      const level = levels.get(action);
      const inside = level?.id ?? byName.get(name);
      if (inside === undefined) {
        if (n > 0) go(addressInside(search, by, here, action));
        return;
      }
      by.push({ graph: here, action });
      here = inside;
      at = typeof level?.graph === "object" && level.graph !== null ? level.graph : { actions: [] };
      levels = level?.levels ?? NO_LEVELS;
      if (n === keys.length - 1) announcer.say(`Inside ${isolated(name)}`);
    }
    go(addressInside(search, by, here));
  });
}

/**
 * Return a function that opens an inner graph by the names of the actions that lead to it, whatever
 * is expanded.
 */
function useWayTo(byName: ReadonlyMap<string, string>) {
  const { id } = useEditorContext();
  const [, go] = useLocation();
  const search = useSearch();
  return useStableCallback((steps: readonly InnerStep[], chosen: string | null) => {
    let here = id;
    const by: Level[] = [];
    for (const { key, name } of steps) {
      const inside = byName.get(name);
      if (inside === undefined) break; // somebody has renamed it meanwhile: open the graph reached so far
      by.push({ graph: here, action: key });
      here = inside;
    }
    if (by.length > 0)
      go(addressInside(search, by, here, by.length === steps.length ? chosen : null));
  });
}

export function Levels() {
  const { id, graph, past, store } = useEditorContext();
  const [, go] = useLocation();
  const search = useSearch();
  useFlatLink();
  const { names, byName, isNamed, idOf } = useGraphsHere(id);
  useNewNames(
    useMemo(() => graph.actions.map(({ name }) => name), [graph]),
    byName,
  );
  const around = addressAround(search, levelsOf(search).length - 1);
  const enter = useWayIn(byName);
  const show = useWayTo(byName);
  const expand = useExpansion({ id, graph, idOf, off: past !== null });
  const leave = useCallback(() => go(around ?? "/"), [go, around]);
  useEffect(() => {
    const way = around === null ? null : leave;
    const ways = { enter, show, leave: way, expand };
    store.graphsInside.set({ names, byName, isNamed, ...ways, Sign: InsideSign });
  }, [store, names, byName, isNamed, enter, show, around, leave, expand]);
  return null;
}
