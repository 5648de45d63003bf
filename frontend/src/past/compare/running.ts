/** What runs of a graph now, as something to compare with: a version of it, or what was sent. Pure. */

import { type Version, versionName } from "../../api/graphs";
import type { Run } from "../../api/runs";
import { isolated } from "../../words/isolated";

type GoingRun = Pick<Run, "id" | "number" | "graph" | "engine" | "version" | "digest">;

export interface RunningGraph {
  readonly run: string;
  /** `atlas now: run 41, v13`. */
  readonly words: string;
  /** The moment of its version; null: it is no version of this graph. */
  readonly seq: number | null;
}

/** What runs, of the runs that go on; a version of another digest is not what it says it is. */
export function runningOf(
  runs: readonly GoingRun[],
  graph: string,
  versions: readonly Version[],
): RunningGraph[] {
  return runs
    .filter((run) => run.graph === graph)
    .map((run) => {
      const version = versions.find(({ id }) => id === run.version);
      const known = version !== undefined && version.digest === run.digest;
      const what = known ? versionName(versions, version.id) : "no version of this graph";
      const words = `${isolated(run.engine)} now: run ${run.number}, ${what}`;
      return { run: run.id, words, seq: known ? version.seq : null };
    });
}
