/** Lays out a graph with elkjs in a web worker, which is loaded when it is first needed. */
import type { ElkNode } from "elkjs/lib/elk-api";
import { useEffect, useMemo, useState } from "react";
import type { Graph } from "../../graph/model";
import { arrange, estimatedSizes, isUnplaced, positionsOf } from "./arrange";
import type { Positions, Sizes } from "./ranks";

/** Signals that a layout was cancelled. */
export class LayoutLeft extends Error {}

interface Running {
  place(graph: Graph, sizes: Sizes, wraps: boolean): Promise<Positions>;
  end(): void;
}

let begun: Promise<Running> | null = null;

async function begin(): Promise<Running> {
  const [{ default: Elk }, { default: url }, { layoutRequest, placesIn, withoutWrapping }] =
    await Promise.all([
      import("elkjs/lib/elk-api"),
      import("elkjs/lib/elk-worker.min.js?url"),
      import("./layout-graph"),
    ]);
  const elk = new Elk({ workerFactory: () => new Worker(url) });
  /** Lays out without wrapping where elkjs fails to wrap. */
  const askTwice = async (root: ElkNode): Promise<ElkNode> => {
    try {
      return await elk.layout(root);
    } catch (error) {
      const simple = withoutWrapping(root);
      if (simple === null) throw error;
      return await elk.layout(simple);
    }
  };
  return {
    place: async (graph, sizes, wraps) => {
      const request = layoutRequest(graph, sizes);
      const { root } = request;
      return placesIn(request, await askTwice(wraps ? root : (withoutWrapping(root) ?? root)));
    },
    end: () => elk.terminateWorker(),
  };
}

/**
 * Return new places for everything, in the direction of the graph. `wraps`: a long graph has several rows. Rejects
 * with `LayoutLeft` when it is cancelled.
 */
export async function layOut(
  graph: Graph,
  sizes: Sizes,
  signal?: AbortSignal,
  wraps = true,
): Promise<Positions> {
  begun ??= begin();
  const mine = begun;
  let leave = () => {};
  const left = new Promise<never>((_, reject) => {
    leave = () => {
      // A worker that computes can only be stopped by ending it.
      if (begun === mine) begun = null;
      void mine.then((running) => running.end()).catch(() => {});
      reject(new LayoutLeft());
    };
    signal?.addEventListener("abort", leave, { once: true });
  });
  if (signal?.aborted) leave();
  const answered = mine.then(({ place }) => place(graph, sizes, wraps));
  // A worker that could not be loaded is loaded again the next time.
  mine.catch(() => {
    if (begun === mine) begun = null;
  });
  try {
    return await Promise.race([answered, left]);
  } finally {
    signal?.removeEventListener("abort", leave);
  }
}

interface LaidOut {
  readonly graph: Graph;
  readonly places: Positions;
  /** A simple layout, shown until the final one is ready. */
  readonly plain: boolean;
}

/** Time after which a simple layout is shown while the final one is being computed. */
export const LAYOUT_PATIENCE_MS = 400;

/**
 * Return the places of a read-only graph: its own, or those of the layout; null while nothing can
 * be drawn yet.
 */
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
