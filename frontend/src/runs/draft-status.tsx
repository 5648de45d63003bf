/** Whether what runs is what is on screen, in words; where it is not, the way to send it. */
import { useMemo } from "react";
import type { Run } from "../api/runs";
import { differences } from "../graph/meaning";
import type { Graph } from "../graph/model";
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

export function DraftStatus({ run, label, graph, seq, settle, obstacle }: Props) {
  const running = useRunningGraph(run);
  const found = useMemo(
    () => (running === null || running.seq === seq ? [] : differences(running.graph, graph)),
    [running, seq, graph],
  );
  if (run === null || run.ended_at !== null) return null;
  return (
    <span className={style.word} data-differs={found.length > 0 || undefined}>
      {found.length > 0 ? "Graph differs from running" : "Running"} <i>{label}</i>
      {found.length > 0 && (
        <PartBoundary waiting={null}>
          <ModifyRun
            run={run}
            label={label}
            found={found}
            seq={seq}
            settle={settle}
            obstacle={obstacle}
          />
        </PartBoundary>
      )}
    </span>
  );
}
