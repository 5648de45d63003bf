/** Marks where a run waits: the run on the canvas, while it is led; else a run that is started now. */
import { useEffect, useMemo } from "react";
import type { EditorStore } from "../canvas/editor-store";
import { breakpointsIn, breakpointWords, runMarks } from "../graph/breakpoints";
import type { Graph } from "../graph/model";
import { useWatched } from "../ui/watched";

const NONE = [] as const;

export function useBreakpointMarks(store: EditorStore, graph: Graph): void {
  // A led run has a copy of its own, which no edit changes.
  const own = useWatched(store.run, (now) => {
    const isLed = now?.run.ended_at === null && now.run.robots && now.names.length === 0;
    return isLed ? (now.run.breakpoints ?? NONE) : null;
  });
  const marks = useMemo(() => {
    if (own !== null) return runMarks(graph, own);
    const found = [...breakpointsIn(graph)].map(([id, each]) => {
      const on = id.includes(">") ? "arrow" : "action";
      return [id, breakpointWords(each, on)] as const;
    });
    return new Map(found);
  }, [graph, own]);
  useEffect(() => store.breakpoints.set(marks), [store, marks]);
}
