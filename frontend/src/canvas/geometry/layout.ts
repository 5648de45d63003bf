/** Lays out a graph with elkjs in a worker of its own, which is loaded when it is first needed. */
import type { ElkNode } from "elkjs/lib/elk-api";
import type { Graph } from "../../graph/model";
import type { Positions, Sizes } from "./arrange";

/** The person did not want to wait for it. */
export class LayoutLeft extends Error {}

interface Running {
  place(graph: Graph, sizes: Sizes): Promise<Positions>;
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
  /** Of what this library cannot wrap it makes one piece. */
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
    place: async (graph, sizes) => {
      const request = layoutRequest(graph, sizes);
      return placesIn(request, await askTwice(request.root));
    },
    end: () => elk.terminateWorker(),
  };
}

/** Fresh places for everything, in the direction of the graph. Rejects with `LayoutLeft` when left. */
export async function layOut(graph: Graph, sizes: Sizes, signal?: AbortSignal): Promise<Positions> {
  begun ??= begin();
  const mine = begun;
  let leave = () => {};
  const left = new Promise<never>((_, reject) => {
    leave = () => {
      // Nothing but its end stops a worker that computes.
      if (begun === mine) begun = null;
      void mine.then((running) => running.end()).catch(() => {});
      reject(new LayoutLeft());
    };
    signal?.addEventListener("abort", leave, { once: true });
  });
  if (signal?.aborted) leave();
  const answered = mine.then(({ place }) => place(graph, sizes));
  // A worker that could not be loaded is asked for again the next time.
  mine.catch(() => {
    if (begun === mine) begun = null;
  });
  try {
    return await Promise.race([answered, left]);
  } finally {
    signal?.removeEventListener("abort", leave);
  }
}
