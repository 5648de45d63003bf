/** Says whether the graph on screen is the one that runs, and offers to send it if it is not. */

import { useMemo } from "react";
import { useLive } from "../api/page-link";
import type { Run } from "../api/runs";
import { differences } from "../graph/meaning";
import type { Graph } from "../graph/model";
import { runStatus } from "../status/progress";
import { boundedPart } from "../ui/lazy-part";
import style from "./draft-status.module.css";
import { useSentGraph } from "./sent-graph";

const ModifyRun = boundedPart(() => import("./modify-run").then((part) => part.ModifyRun), {
  waiting: null,
});

interface Props {
  run: Run | null;
  label: string;
  graph: Graph;
  seq: number;
  /** The name of the moment on screen. */
  settle: () => Promise<number>;
  /** The reason why this moment cannot be sent; null when it can. */
  obstacle: string | null;
}

/** Return the words; the graph that was sent is certain even if the state of the run is unknown. */
function words(differs: boolean, known: boolean): string {
  if (differs) return known ? "Graph differs from running" : "Graph differs from sent";
  return known ? "Running" : "Sent";
}

export function DraftStatus({ run, label, graph, seq, settle, obstacle }: Props) {
  const running = useSentGraph(run);
  const { now } = useLive();
  const found = useMemo(
    () => (running === null || running.seq === seq ? [] : differences(running.graph, graph)),
    [running, seq, graph],
  );
  if (run === null || run.ended_at !== null) return null;
  return (
    <span className={style.word} data-differs={found.length > 0 || undefined}>
      {words(found.length > 0, runStatus(run, now).tone !== "unknown")} <i>{label}</i>
      {running !== null && found.length > 0 && (
        <ModifyRun
          key={run.id}
          run={run}
          label={label}
          running={running.graph}
          settle={settle}
          obstacle={obstacle}
        />
      )}
    </span>
  );
}
