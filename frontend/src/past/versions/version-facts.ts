/** What is told of a version beside its name: its number, and what became of its runs. Pure. */
import type { Version } from "../../api/graphs";
import type { ListedRun } from "../../api/review";
import type { Tone } from "../../status/progress";
import { type Heard, runStatus } from "../../status/run-status";

export interface ListedVersion {
  readonly version: Version;
  /** `v11`: its place among all of them. */
  readonly number: string;
  /** Its runs, the newest first. */
  readonly runs: readonly ListedRun[];
}

/** `versions` and `runs`: the newest first. */
export function listedVersions(
  versions: readonly Version[],
  runs: readonly ListedRun[],
): ListedVersion[] {
  const of = new Map<string, ListedRun[]>();
  for (const run of runs) {
    if (run.version === null) continue;
    const known = of.get(run.version);
    if (known) known.push(run);
    else of.set(run.version, [run]);
  }
  return versions.map((version, i) => ({
    version,
    number: `v${versions.length - i}`,
    runs: of.get(version.id) ?? [],
  }));
}

export interface ResultCount {
  readonly tone: Tone;
  readonly word: string;
  readonly count: number;
}

/** How often its runs ended in which way, the most frequent first. */
export function resultCounts(runs: readonly ListedRun[], heard: Heard): ResultCount[] {
  const found = new Map<string, ResultCount>();
  for (const run of runs) {
    const { tone, word } = runStatus(run, heard);
    const known = found.get(word);
    found.set(word, { tone, word, count: (known?.count ?? 0) + 1 });
  }
  return [...found.values()].sort((a, b) => b.count - a.count);
}

/** `3 runs: 2 finished, 1 error`. */
export function runsWords(runs: readonly ListedRun[], heard: Heard): string {
  const [only, ...others] = runs;
  if (only === undefined) return "No run yet";
  const counted = resultCounts(runs, heard).map(({ word, count }) => `${count} ${word}`);
  return `${others.length === 0 ? "1 run" : `${runs.length} runs`}: ${counted.join(", ")}`;
}

/** The start of a digest, by which people tell versions apart. */
export const shortDigest = (digest: string): string => digest.slice(0, 8);
