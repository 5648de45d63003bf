/** The two moments that are compared, as graphs, and what differs. */
import { useMemo } from "react";
import type { PastPlace } from "../../edit-actions/editor-context";
import type { Graph } from "../../graph/model";
import type { Timeline } from "../told/use-timeline";
import { type PastGraph, usePastGraph } from "../walk/use-walk";
import { momentsOf } from "./compared";
import { changesBetween } from "./graph-difference";
import { useRunGraph } from "./run-graph";
import type { RunningGraph } from "./running";

/** What differs, with the names of who did it as far as the steps are there. */
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

/** `seq`: the newest moment that the page knows; 0 while it knows of none. */
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
    /** By which one steps. */
    walk: to === place.at ? later.walk : earlier.walk,
    error: later.error ?? earlier.error ?? sent.error,
  };
}
