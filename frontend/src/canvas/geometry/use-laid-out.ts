/** Places of a graph that nobody edits here: its own, else those of the layout once it has answered. */
import { useEffect, useMemo, useState } from "react";
import type { Graph } from "../../graph/model";
import { arrange, estimatedSizes, isUnplaced, type Positions, positionsOf } from "./arrange";
import { layOut } from "./layout";

interface Answer {
  readonly graph: Graph;
  readonly places: Positions;
}

/** Null while the layout is being computed. */
export function useLaidOut(graph: Graph): Positions | null {
  const [answer, setAnswer] = useState<Answer | null>(null);
  const loose = isUnplaced(graph);
  useEffect(() => {
    if (!loose) return;
    const end = new AbortController();
    layOut(graph, estimatedSizes(graph), end.signal)
      .catch(() => arrange(graph))
      .then((places) => {
        if (!end.signal.aborted) setAnswer({ graph, places });
      });
    return () => end.abort();
  }, [graph, loose]);
  return useMemo(() => {
    if (!loose) return positionsOf(graph);
    return answer?.graph === graph ? answer.places : null;
  }, [graph, loose, answer]);
}
