/** What is wrong, by where it is drawn: marks for cards and arrows. Pure. */
import type { Problem } from "../api/graphs";

/** The problems of one card or arrow. */
export interface ProblemMark {
  readonly error: number;
  readonly warning: number;
  /** Code and message of each, the errors first, one a line. */
  readonly reasons: string;
}

/** By `aid` or relation id: what the canvas has no place for stands in the list only. */
export type ProblemMarks = ReadonlyMap<string, ProblemMark>;

export const NO_PROBLEM_MARKS: ProblemMarks = new Map();

/** Where on the canvas a problem is: a relation, else an action; null: the graph as a whole. */
export function markedKeyOf({ where }: Problem): string | null {
  return where.relation ?? where.aid ?? null;
}

/** Errors first, then in the order in which the checks found them. */
export function bySeverity(problems: readonly Problem[]): Problem[] {
  const rank = ({ severity }: Problem) => (severity === "error" ? 0 : 1);
  return [...problems].sort((a, b) => rank(a) - rank(b));
}

export function problemMarksOf(problems: readonly Problem[]): ProblemMarks {
  const marks = new Map<string, ProblemMark>();
  for (const problem of bySeverity(problems)) {
    const line = `${problem.code}: ${problem.message}`;
    const others = (problem.also ?? []).map(({ relation, aid }) => relation ?? aid ?? null);
    for (const place of new Set([markedKeyOf(problem), ...others])) {
      if (place === null) continue;
      const { error = 0, warning = 0, reasons = "" } = marks.get(place) ?? {};
      marks.set(place, {
        error: error + (problem.severity === "error" ? 1 : 0),
        warning: warning + (problem.severity === "warning" ? 1 : 0),
        reasons: reasons === "" ? line : `${reasons}\n${line}`,
      });
    }
  }
  return marks;
}

/** "2 errors, 1 warning". */
export function countWords({ error, warning }: Pick<ProblemMark, "error" | "warning">): string {
  const parts: string[] = [];
  if (error > 0) parts.push(error === 1 ? "1 error" : `${error} errors`);
  if (warning > 0) parts.push(warning === 1 ? "1 warning" : `${warning} warnings`);
  return parts.join(", ");
}

/** The mark as the end of an accessible name; empty without one. */
export function problemMarkWords(mark: ProblemMark | null | undefined): string {
  return mark ? `. ${countWords(mark)}. ${mark.reasons.replaceAll("\n", " ")}` : "";
}
