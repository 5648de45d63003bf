/** The part of the list of graphs that is wanted, in the form in which the server is asked for it. Pure. */
import type { GraphsWanted } from "../api/graph-list";
import { hasEnded } from "../api/run-stop";
import type { Run } from "../api/runs";
import { newerFirst } from "../api/sites";

export const ORDERS = {
  changed: "Last changed",
  run: "Last run",
  name: "Name",
  problems: "Most problems",
  size: "Most actions",
} as const;
export type GraphOrder = keyof typeof ORDERS;

export interface GraphFilter {
  readonly search: string;
  /** Every graph shown has it; null: whatever. */
  readonly label: string | null;
  readonly order: GraphOrder;
}

const FIRST = 200; // that one request may name

/** The newest run of each graph, by the graph's id. */
export function lastRuns(runs: readonly Run[]): Map<string, Run> {
  const newest = new Map<string, Run>();
  for (const run of runs) {
    if (run.graph === null) continue;
    const known = newest.get(run.graph);
    if (known === undefined || newerFirst(run, known) < 0) newest.set(run.graph, run);
  }
  return newest;
}

/** Return whether every word of a search stands somewhere in the texts. */
export function matchesSearch(search: string, ...texts: readonly (string | undefined)[]): boolean {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const all = texts.join(" ").toLowerCase();
  return words.every((word) => all.includes(word));
}

/** The graphs that run come first, then those that ran last. */
function lastRunFirst(runs: ReadonlyMap<string, Run>): string[] {
  const ran = (run: Run) => (hasEnded(run) ? run.requested_at : `9${run.requested_at}`);
  return [...runs]
    .sort(([, a], [, b]) => ran(b).localeCompare(ran(a)))
    .slice(0, FIRST)
    .map(([graph]) => graph);
}

/**
 * Return what the list asks the server for, in a folder (null: in none). A search and a label also
 * find what lies in the folders inside of it. `runs`: the newest one of each graph, which only the
 * runner knows.
 */
export function graphsWanted(
  { search, label, order }: GraphFilter,
  folder: string | null,
  runs: ReadonlyMap<string, Run>,
): GraphsWanted {
  const sorted = order === "run" ? { first: lastRunFirst(runs) } : { sort: order };
  const deep = search.trim() !== "" || label !== null;
  return { search, label, folder: folder ?? "", deep, ...sorted };
}
