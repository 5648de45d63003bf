/** Whether what runs is what is on screen, in words; where it is not, the way to send it. */
import { useMemo } from "react";
import { useLive } from "../api/live/use-live";
import type { Run } from "../api/runs";
import { differences } from "../graph/meaning";
import type { Graph } from "../graph/model";
import { runStatus } from "../status/run-status";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";
import style from "./draft-status.module.css";
import { useRunningGraph } from "./use-running-graph";

const ModifyRun = lazyPart(() => import("./modify-run").then((part) => part.ModifyRun));

interface Props {
  run: Run | null;
  label: string;
  graph: Graph;
  seq: number;
  /** The name of the moment on screen. */
  settle: () => Promise<number>;
  /** Why this moment cannot be sent; null when it can. */
  obstacle: string | null;
}

/** What was sent is certain also while nobody knows whether it runs. */
function words(differs: boolean, known: boolean): string {
  if (differs) return known ? "Graph differs from running" : "Graph differs from sent";
  return known ? "Running" : "Sent";
}

export function DraftStatus({ run, label, graph, seq, settle, obstacle }: Props) {
  const running = useRunningGraph(run);
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
        <PartBoundary waiting={null}>
          <ModifyRun
            key={run.id}
            run={run}
            label={label}
            running={running.graph}
            settle={settle}
            obstacle={obstacle}
          />
        </PartBoundary>
      )}
    </span>
  );
}
