/** From a moment of a run to a dry-run that begins there. Pure. */
import type { Run } from "../api/runs";
import { visitBegin } from "../status/progress";
import { instant } from "../ui/times";

/**
 * ms after the start: where the replay stands, `at`; at the end of a run its last action had just
 * begun. Null while nothing has begun.
 */
export function dryRunMoment(run: Run, at: number | null): number | null {
  const start = instant(run.started_at);
  if (start === null) return null;
  if (at !== null) return Math.max(0, Math.round(at - start));
  const begun = Object.values(run.actions ?? {}).flatMap(({ visits }) =>
    visits.map((visit) => visitBegin(visit) ?? start),
  );
  return begun.length === 0 ? null : Math.max(0, Math.round(Math.max(...begun) - start));
}

export function dryRunUrl(graph: string, run: string, moment: number): string {
  const query = new URLSearchParams({ rehearse: run, t: String(moment) });
  return `/graphs/${graph}?${query}`;
}

/** The moment of a run that an address asks for; null where it asks for none. */
export function askedDryRun(search: string): { run: string; t: number } | null {
  const query = new URLSearchParams(search);
  const run = query.get("rehearse");
  const t = Number(query.get("t") ?? "");
  return run !== null && run !== "" && Number.isFinite(t) && t >= 0 ? { run, t } : null;
}
