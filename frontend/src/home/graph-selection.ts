/** Filters and sorts lists of graphs. Pure. */
import type { GraphSummary } from "../api/graphs";
import { hasEnded } from "../api/run-stop";
import type { Run } from "../api/runs";

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

/** The newest run of each graph, by the graph's id. */
export function lastRuns(runs: readonly Run[]): Map<string, Run> {
  const newest = new Map<string, Run>();
  for (const run of runs) {
    if (run.graph === null) continue;
    if (run.number > (newest.get(run.graph)?.number ?? -1)) newest.set(run.graph, run);
  }
  return newest;
}

/** Every word of a search stands somewhere in the texts. */
export function matchesSearch(search: string, ...texts: readonly (string | undefined)[]): boolean {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const all = texts.join(" ").toLowerCase();
  return words.every((word) => all.includes(word));
}

function says({ name, description, robots, labels, people }: GraphSummary): string {
  const names = people?.map((person) => person.name);
  return [name, description, robots, labels, names].flat().join(" ");
}

export function allLabels(graphs: readonly GraphSummary[]): string[] {
  return [...new Set(graphs.flatMap(({ labels }) => labels ?? []))].sort((a, b) =>
    a.localeCompare(b),
  );
}

export function selectGraphs(
  graphs: readonly GraphSummary[],
  { search, label, order }: GraphFilter,
  runs: ReadonlyMap<string, Run>,
): GraphSummary[] {
  const ran = ({ id }: GraphSummary): string => {
    const run = runs.get(id);
    if (run === undefined) return "";
    return hasEnded(run) ? run.requested_at : `9${run.requested_at}`;
  };
  // What is wrong comes before what is to fill in, and both before what may go wrong.
  const worst = ({ wrong = 0, to_fill_in = 0, problems }: GraphSummary) => [
    wrong,
    to_fill_in,
    problems?.error ?? 0,
    problems?.warning ?? 0,
  ];
  const worse = (a: readonly number[], b: readonly number[]) =>
    b.map((count, i) => count - (a[i] ?? 0)).find((more) => more !== 0) ?? 0;
  const by: Record<GraphOrder, (a: GraphSummary, b: GraphSummary) => number> = {
    changed: () => 0,
    run: (a, b) => ran(b).localeCompare(ran(a)),
    name: (a, b) => a.name.localeCompare(b.name, undefined, { numeric: true }),
    problems: (a, b) => worse(worst(a), worst(b)),
    size: (a, b) => (b.actions ?? 0) - (a.actions ?? 0),
  };
  return graphs
    .filter((graph) => label === null || graph.labels?.includes(label))
    .filter((graph) => matchesSearch(search, says(graph)))
    .sort((a, b) => by[order](a, b) || b.updated_at.localeCompare(a.updated_at));
}
