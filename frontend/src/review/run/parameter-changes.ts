/** What the visits of an action ran with, against what was sent. Pure. */
import type { ActionRun } from "../../api/runs";

export interface ParameterRow {
  parameter: string;
  /** JSON text; null where it had no value. */
  sent: string | null;
  /** One for each group of visits. */
  ran: readonly (string | null)[];
}

export interface ParametersOfVisits {
  rows: readonly ParameterRow[];
  /** The groups of visits in words: neighbours that ran with the same are one. */
  visits: readonly string[];
  /** Visits whose values nobody saw. */
  unseen: number;
}

type ReportedValues = Readonly<Record<string, string>>;

interface VisitGroup {
  first: number;
  last: number;
  values: ReportedValues;
}

function alike(a: ReportedValues, b: ReportedValues): boolean {
  const names = Object.keys(a);
  return names.length === Object.keys(b).length && names.every((name) => a[name] === b[name]);
}

function groupsOf(action: ActionRun): VisitGroup[] {
  const groups: VisitGroup[] = [];
  action.visits.forEach((visit, i) => {
    if (visit.inputs == null) return;
    const number = action.older + i + 1;
    const before = groups.at(-1);
    if (before?.last === number - 1 && alike(before.values, visit.inputs)) before.last = number;
    else groups.push({ first: number, last: number, values: visit.inputs });
  });
  return groups;
}

function wordsOf(group: VisitGroup, only: boolean): string {
  if (only) return "Ran with";
  return group.first === group.last
    ? `Visit ${group.first}`
    : `Visits ${group.first}–${group.last}`;
}

const MOST = 12; // groups of visits side by side; the newest

export function parametersOfVisits(sent: ReportedValues, action: ActionRun): ParametersOfVisits {
  const groups = groupsOf(action).slice(-MOST);
  const names = new Set([...Object.keys(sent), ...groups.flatMap((g) => Object.keys(g.values))]);
  const only = groups.length === 1 && action.older + action.visits.length === 1;
  return {
    rows: [...names].sort().map((parameter) => ({
      parameter,
      sent: sent[parameter] ?? null,
      ran: groups.map((group) => group.values[parameter] ?? null),
    })),
    visits: groups.map((group) => wordsOf(group, only)),
    unseen: action.visits.filter((visit) => visit.inputs == null).length,
  };
}
