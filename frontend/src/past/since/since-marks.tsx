/** Keeps marked on the canvas what changed since the last good run, while nobody is at work on it. */
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import { fetchDocument } from "../../api/documents/history";
import { useVersions } from "../../api/graphs";
import { newestRun } from "../../api/live/open-runs";
import { useLive } from "../../api/live/use-live";
import { listRuns, NO_FILTER } from "../../api/review";
import { sinceMarks } from "../../canvas/marks/since-marks";
import { useEditorContext } from "../../edit-actions/editor-context";
import { mapsFrom } from "../../graph/document-keys";
import { readGraph } from "../../graph/read";
import { useRoom } from "../../sync/use-room";
import { whenIdle } from "../../ui/parts/when-idle";
import { type GoodRun, goodRuns } from "../told/good-runs";
import { SinceMarker } from "./since-marker";
import { SinceSign } from "./since-sign";
import { useSinceOn } from "./use-since-on";

const NEWEST = 10; // runs among which the last good one is sought
const QUIET = 900; // ms without an edit, after which marks follow
const IDLE_WITHIN = 1_000; // ms
const NONE: readonly never[] = [];

/** Runs that went well are few enough to be asked for alone, once one has ended. */
function useLastGood(id: string): GoodRun | null {
  const { runner, now } = useLive();
  const newest = newestRun(now, id);
  const ended = newest?.ended_at ?? "";
  const { data: runs = NONE } = useQuery({
    enabled: runner !== undefined,
    queryKey: ["runs", "of", id, "good", ended],
    queryFn: ({ signal }) => {
      const filter = { ...NO_FILTER, graph: id, state: "finished", failed: "false" };
      return listRuns(runner ?? "", filter, null, NEWEST, signal);
    },
    placeholderData: (before) => before,
  });
  const { data: versions = NONE } = useVersions(id, runs[0]?.version ?? null);
  return useMemo(() => goodRuns(runs, versions).at(-1) ?? null, [runs, versions]);
}

/** Calls `work` once nothing has happened for a while and the page has nothing else to do. */
function quietly(work: () => void): { soon(): void; stop(): void } {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let callOff = () => {};
  const stop = () => {
    clearTimeout(timer);
    callOff();
  };
  const soon = () => {
    stop();
    timer = setTimeout(() => {
      callOff = whenIdle(work, IDLE_WITHIN);
    }, QUIET);
  };
  return { soon, stop };
}

function useMarks({ run, seq }: GoodRun): void {
  const { id } = useEditorContext();
  const client = useQueryClient();
  const { source } = useRoom();
  useEffect(() => {
    let over = false;
    let end = () => {};
    const load = async () => {
      const document = await client.fetchQuery({
        queryKey: ["past", id, "document", seq],
        queryFn: ({ signal }) => fetchDocument(id, seq, signal),
        staleTime: Number.POSITIVE_INFINITY,
      });
      if (over) return;
      const marker = new SinceMarker(readGraph(mapsFrom(document)));
      const show = () => {
        const marks = marker.marks(source.graph());
        if (sinceMarks.now()?.marks === marks) return;
        sinceMarks.set({ graph: id, run, seq, marks, Sign: SinceSign });
      };
      const later = quietly(show);
      later.soon();
      const stop = source.subscribe(later.soon);
      end = () => {
        stop();
        later.stop();
      };
    };
    // Without that moment nothing is marked.
    load().catch(() => {});
    return () => {
      over = true;
      end();
      sinceMarks.set(null);
    };
  }, [client, id, run, seq, source]);
}

function Marks(good: GoodRun) {
  useMarks(good);
  return null;
}

function MarksOfNow() {
  const { id } = useEditorContext();
  const good = useLastGood(id);
  return good === null ? null : <Marks {...good} />;
}

/** Nothing is marked while something else than the graph as it is is shown. */
export function SinceMarks() {
  const { past, dryRun } = useEditorContext();
  const [on] = useSinceOn();
  return on && past === null && dryRun === null ? <MarksOfNow /> : null;
}
