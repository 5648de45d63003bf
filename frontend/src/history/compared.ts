/** The two moments that are compared, as graphs, and what differs. */

import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { runnerAt } from "../api/client";
import { type Version, versionName } from "../api/graphs";
import type { HistoryEntry } from "../api/history";
import { engineWords } from "../api/led-runs";
import { useLive } from "../api/page-link";
import type { Run } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import type { PastPlace } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import {
  type Action,
  fullName,
  type Graph,
  type Key,
  type Parameter,
  PRECONDITIONS,
  type Relation,
} from "../graph/model";
import { isEqual } from "../graph/values";
import { day, hourMinute, instant } from "../ui/times";
import { changesBetween } from "./graph-difference";
import { entryAt, type GoodRun, goodBefore, type Timeline } from "./timeline";
import { type PastGraph, usePastGraph } from "./walk";

/** Return the differences, with the names of their authors as far as the steps are loaded. */
function useChanges(
  before: Graph | null,
  { graph: after, walk, here }: PastGraph,
  { entries }: Timeline,
  { from, to }: { from: number | null; to: number },
) {
  const known = walk !== null && from !== null && walk.reaches(from);
  return useMemo(() => {
    if (!here || before === null || after === null) return null;
    const authors = known ? walk.authors(from, to) : null;
    const names = new Map(entries.map(({ author }) => [author.id, author.name]));
    return changesBetween(before, after, (key) => names.get(authors?.get(key) ?? "") ?? null);
  }, [here, known, before, after, walk, from, to, entries]);
}

/** The run that is compared with, and its moment where it has one. */
function useComparedRun(place: PastPlace, running: readonly RunningGraph[], timeline: Timeline) {
  const run =
    typeof place.with === "string" && place.with.startsWith("run/") ? place.with.slice(4) : null;
  const { runs: past, versions } = timeline;
  const runs = useMemo(() => {
    const found = new Map<string, number>();
    for (const { id, version, digest } of past) {
      const same = versions.find((each) => each.id === version && each.digest === digest);
      if (same !== undefined) found.set(id, same.seq);
    }
    for (const { run, seq } of running) if (seq !== null) found.set(run, seq);
    return found;
  }, [past, versions, running]);
  return { run, runs, foreign: run !== null && !runs.has(run) ? run : null };
}

/** Keeps what a moment of the past is compared with. `seq`: the newest moment that the page knows, 0 for none. */
export function useCompared(
  id: string,
  place: PastPlace,
  timeline: Timeline,
  running: readonly RunningGraph[],
  seq: number,
) {
  const { entries, goods } = timeline;
  const newest = Math.max(seq, place.at);
  const { runs, foreign } = useComparedRun(place, running, timeline);
  const moments = momentsOf(place, { entries, goods, runs }, newest);
  const { from, to } = moments;
  const later = usePastGraph(id, seq === 0 ? null : to, newest);
  const earlier = usePastGraph(id, seq === 0 ? null : from, newest);
  const sent = useRunGraph(foreign, later.graph);
  const before = foreign === null ? (earlier.here ? earlier.graph : null) : sent.graph;
  const changes = useChanges(before, later, timeline, moments);
  return {
    ...{ from, to, newest, changes, foreign },
    graph: later.graph,
    here: later.here,
    /** The walk of the side on which the reader steps. */
    walk: to === place.at ? later.walk : earlier.walk,
    error: later.error ?? earlier.error ?? sent.error,
  };
}

export interface ComparedMoments {
  /** Null: nothing is compared. */
  readonly from: number | null;
  readonly to: number;
}

/** The moment before the sitting to which a change belongs; null where there is none, or it is not known. */
function beginning(entries: readonly HistoryEntry[], at: number): number | null {
  const { from_seq } = entryAt(entries, at) ?? {};
  return from_seq === undefined || from_seq < 2 ? null : from_seq - 1;
}

export interface KnownMoments {
  readonly entries: readonly HistoryEntry[];
  readonly goods: readonly GoodRun[];
  /** The moments of runs, by their id, as far as those were started with versions of this graph. */
  readonly runs: ReadonlyMap<string, number>;
}

function otherMoment({ at, with: other }: PastPlace, known: KnownMoments, newest: number) {
  if (typeof other === "number") return other;
  if (other === "nothing") return null;
  if (other === "now") return newest;
  if (other === "own") return beginning(known.entries, at);
  if (other === "good") return goodBefore(known.goods, at)?.seq ?? beginning(known.entries, at);
  return known.runs.get(other.slice("run/".length)) ?? null;
}

/** The later one is drawn, whichever of them was chosen first. */
export function momentsOf(place: PastPlace, known: KnownMoments, newest: number): ComparedMoments {
  const { at } = place;
  const other = otherMoment(place, known, newest);
  if (other === null || other === at) return { from: null, to: at };
  return { from: Math.min(at, other), to: Math.max(at, other) };
}

/** Returns a moment in words by its sitting, as `Ada · today 14:02`; its number where that is not known. */
export function momentWords(entries: readonly HistoryEntry[], at: number, now: number): string {
  const entry = entryAt(entries, at) ?? entries.find(({ seq }) => seq === at);
  const when = instant(entry?.until);
  if (entry === undefined || when === null) return `change ${at}`;
  return `${entry.author.name || "somebody"} · ${day(when, now)} ${hourMinute(when)}`;
}

/** Null while there is nothing to show. `run`: null, where none is wanted. */
function useRunGraph(run: string | null, other: Graph | null) {
  const { runner } = useLive();
  const found = useQuery({
    enabled: run !== null && runner !== undefined,
    queryKey: ["runs", "umrf", run],
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/runs/{run}/umrf", { path: { run: run ?? "" }, signal }),
    staleTime: Number.POSITIVE_INFINITY,
  });
  const { data } = found;
  const graph = useMemo(
    () => (run === null || data === undefined || other === null ? null : read(data, other)),
    [run, data, other],
  );
  return { graph, error: run === null ? null : found.error };
}

const read = (umrf: unknown, other: Graph): Graph => alignedWith(fromUmrf(umrf), other);

type GoingRun = Pick<Run, "id" | "number" | "graph" | "engine" | "robots" | "version" | "digest">;

export interface RunningGraph {
  readonly run: string;
  /** `atlas now: run 41, v13`. */
  readonly words: string;
  /** The moment of its version; null: it is no version of this graph. */
  readonly seq: number | null;
}

/**
 * Return the running graphs among open runs; a version with another digest is not taken for the one
 * that runs.
 */
export function runningOf(
  runs: readonly GoingRun[],
  graph: string,
  versions: readonly Version[],
): RunningGraph[] {
  return runs
    .filter((run) => run.graph === graph)
    .map((run) => {
      const version = versions.find(({ id }) => id === run.version);
      const known = version !== undefined && version.digest === run.digest;
      const what = known ? versionName(versions, version.id) : "no version of this graph";
      const words = `${engineWords(run)} now: run ${run.number}, ${what}`;
      return { run: run.id, words, seq: known ? version.seq : null };
    });
}

function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

const saysSame = (a: string, b: string): boolean => a === b || isEqual(parsed(a), parsed(b));

function parameters(mine: readonly Parameter[], theirs: readonly Parameter[]): Parameter[] {
  const known = new Map(theirs.map((each) => [each.path, each]));
  return mine.map((each) => {
    const other = known.get(each.path);
    return other !== undefined && saysSame(each.text, other.text) ? other : each;
  });
}

/**
 * Take the members that a file and a document hold in different places from the other action, so
 * that they are not compared.
 */
function action(mine: Action, other: Action): Action {
  const { missing, twin, extra } = other;
  const inputs = parameters(mine.inputs, other.inputs);
  const outputs = parameters(mine.outputs, other.outputs);
  const same = (a: readonly Parameter[], b: readonly Parameter[]) =>
    a.length === b.length && a.every((each) => b.includes(each));
  return {
    ...mine,
    ...{ key: other.key, missing, twin, extra },
    inputs: same(inputs, other.inputs) ? other.inputs : inputs,
    outputs: same(outputs, other.outputs) ? other.outputs : outputs,
    position: mine.position ?? other.position,
  };
}

function relation(mine: Relation, other: Relation): Relation {
  const same =
    mine.required === other.required &&
    PRECONDITIONS.every((on) => mine.conditions[on] === other.conditions[on]) &&
    mine.remap.length === other.remap.length &&
    mine.remap.every(({ source, target }) =>
      other.remap.some((each) => each.source === source && each.target === target),
    );
  return same ? other : { ...mine, waypoints: other.waypoints };
}

/** Returns `graph` with the objects of `other` wherever both say the same. */
export function alignedWith(graph: Graph, other: Graph): Graph {
  const keys = new Set(other.actions.map(({ key }) => key));
  const byName = new Map(other.actions.map((each) => [fullName(each), each]));
  const found = new Map<Key, Action>();
  for (const each of graph.actions) {
    const same = keys.has(each.key)
      ? other.actions.find(({ key }) => key === each.key)
      : byName.get(fullName(each));
    if (same !== undefined) found.set(each.key, same);
  }
  const keyOf = (key: Key): Key => found.get(key)?.key ?? key;
  const arrows = new Map(other.relations.map((each) => [relationId(each), each]));
  const { name, description, direction, extra } = other;
  return {
    ...graph,
    // The name of a sent graph may be its robot's; how it is drawn is nobody's but the editor's.
    ...{ name, direction, extra, description: graph.description || description },
    notes: other.notes,
    actions: graph.actions.map((each) => {
      const same = found.get(each.key);
      return same === undefined ? each : action(each, same);
    }),
    relations: graph.relations.map((each) => {
      const moved = { ...each, parent: keyOf(each.parent), child: keyOf(each.child) };
      const same = arrows.get(relationId(moved));
      return same === undefined ? moved : relation(moved, same);
    }),
  };
}
