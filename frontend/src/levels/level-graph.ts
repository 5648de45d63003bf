/** The tree of graphs that are expanded on the cards of their actions. Unchanged parts keep their identity. */

import { keepPreviousData, useQueries } from "@tanstack/react-query";
import { useMemo } from "react";
import { editor } from "../api/client";
import { useSomeGraphs } from "../api/graph-list";
import { queryKeys } from "../api/graphs";
import { errorText } from "../api/http";
import type { LevelGraph } from "../canvas/editor-store";
import { fromUmrf } from "../canvas/from-umrf";
import type { Graph, Key } from "../graph/model";

type LevelAction = LevelGraph["names"][number];

/** The graphs of the server, as far as they are loaded. */
export interface KnownGraphs {
  /** Returns the id of the graph for which actions of this name stand. */
  idOf(name: string): string | undefined;
  graphOf(id: string): Graph | string | null;
}

const joined = (path: string, key: Key): string => (path === "" ? key : `${path}/${key}`);

const called = ({ name, instanceId }: LevelAction) => `${name} ${instanceId}`;

const same = (a: LevelGraph, b: LevelGraph): boolean =>
  a.id === b.id &&
  a.graph === b.graph &&
  String(a.names.map(called)) === String(b.names.map(called)) &&
  a.levels.size === b.levels.size &&
  [...a.levels].every(([key, level]) => b.levels.get(key) === level);

/**
 * Return the expanded graphs below the actions of `graph`. `above`: ids of the surrounding graphs;
 * within a graph of its own name, an action stands for no graph, as in engines.
 */
export function levelsBelow(
  graph: Graph,
  expanded: ReadonlySet<string>,
  known: KnownGraphs,
  before: ReadonlyMap<Key, LevelGraph> | undefined,
  around: { path: string; names: readonly LevelAction[]; above: readonly string[] },
): ReadonlyMap<Key, LevelGraph> {
  const found = new Map<Key, LevelGraph>();
  for (const action of graph.actions) {
    const path = joined(around.path, action.key);
    if (!expanded.has(path)) continue;
    const id = known.idOf(action.name);
    if (id === undefined || around.above.includes(id)) continue;
    const last = before?.get(action.key);
    const { name, instanceId } = action;
    const names = [...around.names, { name, instanceId }];
    const inner = known.graphOf(id);
    const below = { path, names, above: [...around.above, id] };
    const levels =
      inner === null || typeof inner === "string"
        ? new Map<Key, LevelGraph>()
        : levelsBelow(inner, expanded, known, last?.levels, below);
    const level = { id, path, names, graph: inner, levels };
    found.set(action.key, last && same(last, level) ? last : level);
  }
  const unchanged =
    before?.size === found.size && [...found].every(([key, level]) => before.get(key) === level);
  return before && unchanged ? before : found;
}

/** Return the paths of all actions that stand for a graph, down to `depth` levels. */
export function pathsTo(
  graph: Graph,
  depth: number,
  known: KnownGraphs,
  around: { path: string; above: readonly string[] },
): string[] {
  if (depth === 0) return [];
  return graph.actions.flatMap(({ key, name }) => {
    const id = known.idOf(name);
    if (id === undefined || around.above.includes(id)) return [];
    const path = joined(around.path, key);
    const inner = known.graphOf(id);
    if (inner === null || typeof inner === "string") return [path];
    const below = { path, above: [...around.above, id] };
    return [path, ...pathsTo(inner, depth - 1, known, below)];
  });
}

const read = (umrf: unknown): Graph => fromUmrf(umrf);

/**
 * Load graphs by id: each is a graph, the text of an error, or null while it loads. Unchanged
 * graphs keep their identity.
 */
export function useLevelGraphs(ids: readonly string[]): ReadonlyMap<string, Graph | string | null> {
  const { data: graphs } = useSomeGraphs(ids);
  const found = useQueries({
    queries: ids.map((id) => {
      // The list of graphs tells of every change; without it each graph is loaded once.
      const seq = graphs?.find((graph) => graph.id === id)?.seq ?? 0;
      const wanted = { path: { graph_id: id }, query: { identities: true } };
      return {
        queryKey: [...queryKeys.graph(id), "umrf", seq],
        queryFn: ({ signal }: { signal: AbortSignal }) =>
          editor.get("/api/graphs/{graph_id}/umrf", { ...wanted, signal }),
        placeholderData: keepPreviousData,
        select: read,
      };
    }),
    combine: (results) =>
      results.map(({ data, error }) => data ?? (error ? errorText(error) : null)),
  });
  return useMemo(() => new Map(ids.map((id, i) => [id, found[i] ?? null])), [ids, found]);
}
