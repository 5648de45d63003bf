/** The moment of a run from which a dry-run is asked for, as the record has it. */
import { useRef } from "react";
import { useRun } from "../../api/runs";
import { fromUmrf } from "../../canvas/from-umrf";
import { type DryRunSeed, seedOf } from "../../dry-run/seed";
import { differences } from "../../graph/meaning";
import type { Graph } from "../../graph/model";
import { instant } from "../../ui/times";

/** Of a run, `t` ms after its start. */
interface Asked {
  run: string;
  t: number;
}

/** Made once for each moment that is asked for: the graph as it was when the record arrived. */
export function useSeed(
  runner: string | undefined,
  asked: Asked | null,
  graph: Graph,
  begun: boolean,
): DryRunSeed | null {
  const run = useRun(asked === null ? undefined : runner, asked?.run ?? "").data;
  const made = useRef<{ asked: Asked; seed: DryRunSeed } | null>(null);
  if (asked === null || run === undefined || !begun) return null;
  const { current } = made;
  if (current?.asked.run === asked.run && current.asked.t === asked.t) return current.seed;
  const start = instant(run.started_at ?? run.requested_at) ?? 0;
  const differs = differences(fromUmrf(run.umrf), graph).length;
  const seed = seedOf(run, graph, differs, start + asked.t);
  made.current = { asked, seed };
  return seed;
}
