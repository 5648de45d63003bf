/** Below the canvas while it shows the past: what one sees, the line of all moments, and the way back. */
import { Button, NativeSelect } from "@mantine/core";
import { IconHistory } from "@tabler/icons-react";
import { useEffect, useLayoutEffect, useMemo } from "react";
import { versionName } from "../api/graphs";
import { errorText } from "../api/http";
import {
  type EditorContext,
  type PastPlace,
  useEditorContext,
} from "../edit-actions/editor-context";
import type { Graph } from "../graph/model";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import { useNow } from "../ui/times";
import { ChangesWalk } from "./compare/changes-walk";
import { momentsOf, momentWords } from "./compare/compared";
import { changesBetween, type GraphChanges } from "./compare/graph-difference";
import style from "./past-bar.module.css";
import { marksOf, Scrubber } from "./scrubber";
import { type Timeline, useTimeline } from "./told/use-timeline";
import { type PastGraph, usePastGraph } from "./use-walk";

export interface SeenPast {
  /** As it was; without what is drawn of another moment. */
  readonly graph: Graph;
  /** What differs from the moment with which it is compared. */
  readonly changes: GraphChanges | null;
}

/** What differs, with the names of who did it as far as the steps are there. */
function useChanges(
  later: PastGraph,
  earlier: PastGraph,
  timeline: Timeline,
  from: number | null,
  to: number,
) {
  const { entries } = timeline;
  const ready = from !== null && later.here && earlier.here;
  const { walk } = later;
  const [before, after] = [earlier.graph, later.graph];
  const known = walk !== null && from !== null && walk.reaches(from);
  return useMemo(() => {
    if (!ready || before === null || after === null) return null;
    const authors = known ? walk.authors(from, to) : null;
    const names = new Map(entries.map(({ author }) => [author.id, author.name]));
    return changesBetween(before, after, (key) => names.get(authors?.get(key) ?? "") ?? null);
  }, [ready, known, before, after, walk, from, to, entries]);
}

/** Nothing that was begun on the graph as it is now goes on over the past. */
function useNothingOpen({ openOverlay, dryRun }: EditorContext): void {
  // biome-ignore lint/correctness/useExhaustiveDependencies: once, when one begins to look back
  useEffect(() => {
    openOverlay(null);
    dryRun?.close();
  }, []);
}

interface CompareProps {
  place: PastPlace;
  timeline: Timeline;
  newest: number;
}

/** With what the moment is compared: any other one that has a name. */
function CompareWith({ place, timeline, newest }: CompareProps) {
  const { lookAt } = useEditorContext();
  const now = useNow(60_000);
  const { versions, entries, lastGood } = timeline;
  const marked = typeof place.with === "number" ? place.with : null;
  const isVersion = lastGood?.seq === marked || versions.some(({ seq }) => seq === marked);
  const data = [
    { value: "own", label: "the moment before this sitting" },
    ...(lastGood === null
      ? []
      : [{ value: `${lastGood.seq}`, label: `the last good run, run ${lastGood.run}` }]),
    { value: "now", label: "now" },
    ...versions.map((version) => ({
      value: `${version.seq}`,
      label: `version ${versionName(versions, version.id)}`,
    })),
    ...(marked !== null && !isVersion
      ? [{ value: `${marked}`, label: momentWords(entries, marked, now) }]
      : []),
    { value: "here", label: "this moment, from here on" },
    { value: "nothing", label: "nothing" },
  ].filter(({ value }, i, all) => all.findIndex((each) => each.value === value) === i);
  return (
    <NativeSelect
      size="xs"
      aria-label="Compare with"
      data={data}
      value={`${place.with}`}
      disabled={newest === 0}
      onChange={(event) => {
        const { value } = event.currentTarget;
        const chosen = value === "own" || value === "now" || value === "nothing" ? value : null;
        const seq = value === "here" ? place.at : Number(value);
        lookAt({ at: place.at, with: chosen ?? seq });
      }}
    />
  );
}

interface Props {
  place: PastPlace;
  show: (seen: SeenPast | null) => void;
}

export function PastBar({ place, show }: Props) {
  const context = useEditorContext();
  const { id, lookAt } = context;
  const { seq } = useThrottledLink();
  const now = useNow(60_000);
  const timeline = useTimeline(id);
  const { entries, items, versions } = timeline;
  const newest = Math.max(seq, place.at);
  const { from, to } = momentsOf(place, entries, newest);
  const later = usePastGraph(id, seq === 0 ? null : to, newest);
  const earlier = usePastGraph(id, seq === 0 ? null : from, newest);
  const changes = useChanges(later, earlier, timeline, from, to);
  useNothingOpen(context);
  const { graph } = later;
  useLayoutEffect(() => {
    if (graph !== null) show({ graph, changes });
  }, [show, graph, changes]);
  const marks = useMemo(() => marksOf(items, versions), [items, versions]);
  const colorOf = usePersonColors(entries.map(({ author }) => author.id));
  const goTo = (at: number) => lookAt({ ...place, at: Math.min(Math.max(1, at), newest) });
  const walk = to === place.at ? later.walk : earlier.walk;
  const error = later.error ?? earlier.error;
  return (
    <section className={style.bar} aria-label="The past" data-past aria-busy={!later.here}>
      <div className={style.row}>
        <p className={style.title}>
          <IconHistory size={16} aria-hidden /> <b>You look at the past.</b>{" "}
          <span>Nothing here changes the graph.</span>
        </p>
        <span className={style.when}>{momentWords(entries, place.at, now)}</span>
        <Button size="compact-sm" variant="filled" onClick={() => lookAt(null)}>
          Back to now
        </Button>
      </div>
      <Scrubber
        at={place.at}
        other={from === null ? null : from === place.at ? to : from}
        newest={newest}
        words={momentWords(entries, place.at, now)}
        {...{ marks, colorOf }}
        onAt={goTo}
        onStep={(by) => goTo(walk?.neighbour(by) ?? place.at + by)}
        onLeave={() => lookAt(null)}
      />
      <div className={style.row}>
        <span className={style.compare}>
          Compare with <CompareWith place={place} timeline={timeline} newest={newest} />
        </span>
        {changes && <ChangesWalk changes={changes} />}
        {seq === 0 && <p>The past is on the server, which is not there now.</p>}
        {error && <p role="alert">{errorText(error)}</p>}
      </div>
    </section>
  );
}
