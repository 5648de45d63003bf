/** Reads the record of a run for a dry-run that goes on from one of its moments; loaded late. Pure. */
import type { Run } from "../../api/runs";
import { fromUmrf } from "../../canvas/from-umrf";
import type { DryRunSeed } from "../../dry-run/seed";
import { seedOf } from "../../dry-run/seed-of-run";
import { differences } from "../../graph/meaning";
import type { Graph } from "../../graph/model";
import { instant } from "../../ui/times";

/** `graph`: what is played; `at`: ms after the run's start. */
export function seedOfMoment(run: Run, graph: Graph, at: number): DryRunSeed {
  const start = instant(run.started_at ?? run.requested_at) ?? 0;
  return seedOf(run, graph, differences(fromUmrf(run.umrf), graph).length, start + at);
}
