/** Runs that went well, as moments with which others are compared. Pure. */
import { wentWell } from "../../api/documents/since";
import type { Version } from "../../api/graphs";
import type { Run } from "../../api/runs";

/** A run that went well, and the moment of what it was started with. */
export interface GoodRun {
  readonly run: number;
  readonly seq: number;
}

type EndedRun = Pick<Run, "number" | "version" | "state" | "result">;

/** Those that were started with a version that is known, the last one last. */
export function goodRuns(
  runs: readonly EndedRun[],
  versions: readonly Pick<Version, "id" | "seq">[],
): GoodRun[] {
  const seqOf = new Map(versions.map(({ id, seq }) => [id, seq]));
  return runs
    .filter(wentWell)
    .flatMap(({ number: run, version }) => {
      const seq = seqOf.get(version ?? "");
      return seq === undefined ? [] : [{ run, seq }];
    })
    .sort((a, b) => a.run - b.run);
}

/** The last one that was started with something before a moment. `goods` are in the order of runs. */
export function goodBefore(goods: readonly GoodRun[], at: number): GoodRun | null {
  return goods.findLast(({ seq }) => seq < at) ?? null;
}
