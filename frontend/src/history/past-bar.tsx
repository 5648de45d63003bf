/** Shows below the canvas, while that shows the past, which moment it is, the line of all moments, and the way back. */
import { Button } from "@mantine/core";
import { IconHistory } from "@tabler/icons-react";
import { useEffect, useLayoutEffect, useMemo } from "react";
import { errorText } from "../api/http";
import type { ChangeMarks } from "../canvas/marks/change-marks";
import {
  type EditorContext,
  type PastPlace,
  useEditorContext,
} from "../edit-actions/editor-context";
import type { Graph } from "../graph/model";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import { Segments } from "../ui/segments";
import { useNow } from "../ui/times";
import { useWatched } from "../ui/watched";
import { ChangesWalk } from "./changes-walk";
import { CompareWith, useRunning } from "./compare-with";
import { momentWords, useCompared } from "./compared";
import type { GraphChanges } from "./graph-difference";
import style from "./past-bar.module.css";
import { useGoingBack } from "./restoring";
import { marksOf, Scrubber } from "./scrubber";
import { EarlierCanvas, type SideBySide, sideBySide } from "./side-by-side";
import { useTimeline } from "./timeline";

export interface SeenPast {
  /** The graph at that moment, without parts that are drawn from another moment. */
  readonly graph: Graph;
  /** Differences from the moment that it is compared with; null if it is compared with none. */
  readonly changes: GraphChanges | null;
  /** The graph on the canvas; also removed parts, unless a second canvas beside it shows them. */
  readonly drawn: Graph;
  readonly marks: ChangeMarks | null;
  /** The second canvas beside it; null if one canvas shows all. */
  readonly side: SideBySide | null;
}

function seenPast(
  graph: Graph,
  changes: GraphChanges | null,
  words: readonly [earlier: string, later: string] | null,
): SeenPast {
  const side =
    changes === null || words === null ? null : sideBySide(changes, words, EarlierCanvas);
  if (side !== null) return { graph, changes, drawn: graph, marks: side.marks[1], side };
  const { shown, marks } = changes ?? { shown: graph, marks: null };
  return { graph, changes, drawn: shown, marks, side };
}

/** Close overlays and the dry-run of the present graph while the past is shown. */
function useNothingOpen({ openOverlay, dryRun }: EditorContext): void {
  // biome-ignore lint/correctness/useExhaustiveDependencies: once, when one begins to look back
  useEffect(() => {
    openOverlay(null);
    dryRun?.close();
  }, []);
}

const VIEWS = [
  { value: "one", label: "One canvas" },
  { value: "side", label: "Side by side" },
] as const;

interface Props {
  /** The moment that the canvas shows now. */
  drawn: PastPlace;
  /**
   * The moment that was asked for last: until its graph is loaded, a step renders this bar only.
   */
  wanted: { subscribe: (listener: () => void) => () => void; now: () => PastPlace | null };
  show: (seen: SeenPast, place: PastPlace) => void;
  /** The two moments stand beside each other. */
  side: boolean;
  onSide: (side: boolean) => void;
}

export function PastBar({ drawn, wanted, show, side, onSide }: Props) {
  const place = useWatched(wanted) ?? drawn;
  const context = useEditorContext();
  const { id, lookAt, mayGoBack } = context;
  const { busy, restore } = useGoingBack(context);
  const { seq } = useThrottledLink();
  const now = useNow(60_000);
  const timeline = useTimeline(id);
  const running = useRunning(id, timeline);
  const { entries, items, versions } = timeline;
  const compared = useCompared(id, place, timeline, running, seq);
  const { graph, changes, newest, from, to } = compared;
  useNothingOpen(context);
  const words = (at: number | null) =>
    at === null ? "" : at === newest ? "now" : momentWords(entries, at, now);
  const [before, after] = [compared.foreign === null ? words(from) : "as it runs", words(to)];
  const { here } = compared;
  useLayoutEffect(() => {
    if (graph !== null && here) {
      show(seenPast(graph, changes, side ? [before, after] : null), place);
    }
  }, [show, graph, here, changes, side, before, after, place]);
  const marks = useMemo(() => marksOf(items, versions), [items, versions]);
  const colorOf = usePersonColors(entries.map(({ author }) => author.id));
  const goTo = (at: number) => lookAt({ ...place, at: Math.min(Math.max(1, at), newest) });
  return (
    <section
      className={`${style.bar} fingers`}
      aria-label="The past"
      data-past
      data-at={compared.here ? place.at : undefined}
      aria-busy={!compared.here}
    >
      <div className={style.row}>
        <p className={style.title}>
          <IconHistory size={16} aria-hidden /> <b>You look at the past.</b>{" "}
          <span>Nothing here changes the graph.</span>
        </p>
        <span className={style.when}>{momentWords(entries, place.at, now)}</span>
        {mayGoBack && place.at < seq && (
          <Button
            size="compact-sm"
            variant="default"
            loading={busy}
            onClick={() => void restore(place.at)}
          >
            Restore
          </Button>
        )}
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
        onStep={(by) => goTo(compared.walk?.neighbour(by) ?? place.at + by)}
        onLeave={() => lookAt(null)}
      />
      <div className={style.row}>
        <span className="inline-row gap-6px nowrap ink2">
          Compare with <CompareWith {...{ place, timeline, running, newest }} />
        </span>
        {changes && (
          <Segments
            label="How both are shown"
            size="xs"
            data={VIEWS}
            value={side ? "side" : "one"}
            onChange={(next) => onSide(next === "side")}
          />
        )}
        {changes && <ChangesWalk changes={changes} />}
        {compared.foreign !== null && <Foreign run={compared.foreign} {...{ running }} />}
        {seq === 0 && <p>The past is stored on the server, which does not answer now.</p>}
        {compared.error && <p role="alert">{errorText(compared.error)}</p>}
      </div>
    </section>
  );
}

/** Says that a run executes a graph that was never published here. */
function Foreign({ run, running }: { run: string; running: ReturnType<typeof useRunning> }) {
  const words = running.find((each) => each.run === run)?.words ?? "a run that is over";
  return (
    <p role="note" className={style.foreign}>
      <b>What runs is no version of this graph</b> ({words}). It is compared as it was sent; who
      made the differences is not known.
    </p>
  );
}
