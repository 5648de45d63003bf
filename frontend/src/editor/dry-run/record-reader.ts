/** Reads the record of a run as the start of a dry-run. It is loaded late. Pure. */
import type { Run } from "../../api/runs";
import { fromUmrf } from "../../canvas/from-umrf";
import type { DryRunSeed } from "../../dry-run/seed";
import { seedOf } from "../../dry-run/seed-of-run";
import { differences } from "../../graph/meaning";
import type { Graph } from "../../graph/model";
import { instant } from "../../ui/times";

/** Return the state of a run at a moment. `graph`: the graph to play; `at`: ms after the start of the run. */
export function seedOfMoment(run: Run, graph: Graph, at: number): DryRunSeed {
  const start = instant(run.started_at ?? run.requested_at) ?? 0;
  return seedOf(run, graph, differences(fromUmrf(run.umrf), graph).length, start + at);
}
