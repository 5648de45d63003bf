/** Keeps which graphs are expanded, and tells the canvas, which makes room for them. */

import { useEffect, useMemo, useRef, useState } from "react";
import type { LevelGraph, PartOnCard } from "../canvas/editor-store";
import { useEditorContext } from "../edit-actions/editor-context";
import type { Graph, Key } from "../graph/model";
import { announcer } from "../ui/announcer";
import { useKeptKeys, useStableCallback } from "../ui/hooks";
import { useWatched } from "../ui/watched";
import { ExpandedCard, progressOf, type StateSource } from "./level-frame";
import { type KnownGraphs, levelsBelow, pathsTo, useLevelGraphs } from "./level-graph";
import { layoutOf } from "./level-layout";
import { spreadOf } from "./room";

/** More graphs than this are not expanded at once: deep hierarchies grow too fast to be looked at. */
const MOST = 400;
export const NO_LEVELS: ReadonlyMap<Key, LevelGraph> = new Map();
const NO_IDS: readonly string[] = [];

/** Return the ids of all expanded graphs. */
function idsOf(levels: ReadonlyMap<Key, LevelGraph>, found = new Set<string>()): Set<string> {
  for (const level of levels.values()) {
    found.add(level.id);
    idsOf(level.levels, found);
  }
  return found;
}

/** Return whether the graph of a path is loaded. */
function isDrawn(levels: ReadonlyMap<Key, LevelGraph>, path: string): boolean {
  const [first = "", ...rest] = path.split("/");
  const level = levels.get(first);
  if (!level || rest.length === 0) return typeof level?.graph === "object" && level.graph !== null;
  return isDrawn(level.levels, rest.join("/"));
}

/** ms after which the cards are rendered at their new places. */
const SETTLED_MS = 60;

const depthOf = (path: string): number => path.split("/").length;

interface ExpansionInput {
  readonly id: string;
  readonly graph: Graph;
  readonly idOf: KnownGraphs["idOf"];
  /** True if nothing can be expanded, for example while the past is shown. */
  readonly off: boolean;
}

/** Return the tree of expanded graphs. It grows level by level, since each graph must be loaded first. */
function useLevels({ id, graph, idOf, off }: ExpansionInput, expanded: ReadonlySet<string>) {
  const [ids, setIds] = useState(NO_IDS);
  const graphs = useLevelGraphs(ids);
  const last = useRef(NO_LEVELS);
  const known = useMemo<KnownGraphs>(
    () => ({ idOf, graphOf: (inner) => graphs.get(inner) ?? null }),
    [idOf, graphs],
  );
  const levels = useMemo(
    () =>
      off || expanded.size === 0
        ? NO_LEVELS
        : levelsBelow(graph, expanded, known, last.current, { path: "", names: [], above: [id] }),
    [off, graph, expanded, known, id],
  );
  useEffect(() => {
    last.current = levels;
    const wanted = [...idsOf(levels)].sort();
    setIds((before) => (before.join() === wanted.join() ? before : wanted));
  }, [levels]);
  return { levels, known };
}

/** Return the actions of a level and of all levels below it, with places relative to the outermost card. */
function partsOf(level: LevelGraph | undefined, source: StateSource): PartOnCard[] {
  if (level === undefined) return [];
  const progress = progressOf(level, source);
  return layoutOf(level).cards.flatMap(({ action, x, y, width, height }) => {
    const { key } = action;
    const inner = level.levels.get(key);
    const states = { progress: progress.get(key) ?? null, expanded: inner !== undefined };
    const own = { path: `${level.path}/${key}`, x, y, width, height, action, ...states };
    const below = partsOf(inner, source);
    return [own, ...below.map((part) => ({ ...part, x: x + part.x, y: y + part.y }))];
  });
}

/** Return a ref to the current sources of states, for callers outside of rendering. */
function useStateSource() {
  const { dryRun, graph, store } = useEditorContext();
  const run = useWatched(store.run);
  const source = useRef<StateSource>({ dryRun, run, outermost: graph.name });
  source.current = { dryRun, run, outermost: graph.name };
  return source;
}

/** Manages the expanded graphs of the canvas. Returns the functions that expand and collapse them. */
export function useExpansion(given: ExpansionInput) {
  const { id, graph } = given;
  const {
    view,
    store: { expanded: onCards },
  } = useEditorContext();
  const { keys: expanded, put } = useKeptKeys("aa.expanded", id);
  const { levels, known } = useLevels(given, expanded);
  const [goal, setGoal] = useState(0);
  const toReveal = useRef<string | null>(null);
  const toggle = useStableCallback((path: string) => {
    setGoal(0);
    const isOpen = expanded.has(path);
    const below = [...expanded].filter((each) => each === path || each.startsWith(`${path}/`));
    if (isOpen) put(below, false);
    else put([path], true);
    toReveal.current = isOpen ? null : path;
    announcer.say(isOpen ? "Collapsed" : "Expanded");
  });
  const source = useStateSource();
  useEffect(() => {
    const sizes = new Map([...levels].map(([key, level]) => [key, layoutOf(level).size]));
    onCards.set(
      sizes.size === 0
        ? null
        : {
            ...{ levels, sizes, Frame: ExpandedCard },
            partsOf: (key) => partsOf(levels.get(key), source.current),
            spread: (standing) => spreadOf(standing, sizes),
          },
    );
  }, [onCards, levels, source]);
  // Once it is loaded and has its room, the expanded graph is brought into view.
  useEffect(() => {
    const [first = ""] = toReveal.current?.split("/") ?? [];
    if (!levels.has(first) || !isDrawn(levels, toReveal.current ?? "")) return;
    const timer = setTimeout(() => {
      toReveal.current = null;
      view.show([first]);
    }, SETTLED_MS);
    return () => clearTimeout(timer);
  }, [levels, view]);
  // Inner graphs become known one level after the other.
  useEffect(() => {
    if (goal === 0) return;
    const all = pathsTo(graph, goal, known, { path: "", above: [id] });
    const missing = all.filter((path) => !expanded.has(path));
    if (missing.length > 0 && expanded.size < MOST)
      put(missing.slice(0, MOST - expanded.size), true);
  }, [goal, graph, known, expanded, put, id]);
  const depth = Math.max(0, ...[...expanded].map(depthOf));
  const expandMore = useStableCallback(() => {
    setGoal(Math.max(goal, depth) + 1);
    announcer.say("Expanded one level more");
  });
  const collapseAll = useStableCallback(() => {
    setGoal(0);
    put([...expanded], false);
    announcer.say("Collapsed");
  });
  return useMemo(
    () => ({ toggle, expandMore, collapseAll, isAnyExpanded: () => expanded.size > 0 }),
    [toggle, expandMore, collapseAll, expanded],
  );
}
