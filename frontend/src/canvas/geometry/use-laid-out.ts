/** Places of a graph that nobody edits here: its own, else those of the layout once it has answered. */
import { useEffect, useMemo, useState } from "react";
import type { Graph } from "../../graph/model";
import { arrange, estimatedSizes, isUnplaced, type Positions, positionsOf } from "./arrange";
import { layOut } from "./layout";

interface LaidOut {
  readonly graph: Graph;
  readonly places: Positions;
  /** Shown until the layout answers. */
  readonly plain: boolean;
}

/** Whoever waits longer for the layout sees a plain one meanwhile. */
export const LAYOUT_PATIENCE_MS = 400;

/** Null for a moment, while the layout is being computed. */
export function useLaidOut(graph: Graph): LaidOut | null {
  const [answer, setAnswer] = useState<LaidOut | null>(null);
  const loose = isUnplaced(graph);
  useEffect(() => {
    if (!loose) return;
    const end = new AbortController();
    const plain = () => setAnswer({ graph, places: arrange(graph), plain: true });
    const timer = setTimeout(plain, LAYOUT_PATIENCE_MS);
    layOut(graph, estimatedSizes(graph), end.signal)
      .catch(() => arrange(graph))
      .then((places) => {
        clearTimeout(timer);
        if (!end.signal.aborted) setAnswer({ graph, places, plain: false });
      });
    return () => {
      clearTimeout(timer);
      end.abort();
    };
  }, [graph, loose]);
  return useMemo(() => {
    if (!loose) return { graph, places: positionsOf(graph), plain: false };
    return answer?.graph === graph ? answer : null;
  }, [graph, loose, answer]);
}
