import { counted } from "../../words/counted";

/**
 * Sorts problems into what is wrong, what is only not written yet, and what may go wrong: the twin of
 * `umrf/problem_kinds.py`, which counts them for lists of graphs. Pure.
 */

interface CheckedPlace {
  readonly aid?: string;
  readonly relation?: string;
  readonly path?: string;
}

/** A place in the graph that an action stands for; `aids` are the actions that lead there, outermost first. */
export interface CheckedPlaceInside {
  readonly levels: readonly string[];
  readonly aids: readonly string[];
  readonly code: string;
  readonly message: string;
  readonly where?: CheckedPlace;
}

/** The parts of a checked problem that are needed here. */
export interface CheckedProblem {
  readonly code: string;
  readonly severity: "error" | "warning";
  readonly message: string;
  readonly where: CheckedPlace;
  /** Further places with the same problem. */
  readonly also?: readonly CheckedPlace[];
  readonly fix?: string | null;
  readonly inside?: CheckedPlaceInside;
}

/**
 * `wrong`: certain harm, or a mistake. `fill-in`: still to be written. `warning`: may go wrong. `note`: what is so
 * with nearly every graph on this engine.
 */
export type ProblemKind = "wrong" | "fill-in" | "warning" | "note";

/** Codes that say that something has not been written or connected so far. */
const UNWRITTEN: ReadonlySet<string> = new Set([
  "empty",
  "graph-name-empty",
  "graph-name-missing",
  "name-empty",
  "no-entry",
  "no-exit",
  "type-empty",
  "type-missing",
  "unreachable",
]);

/** Mistakes whose harm no engine notices, so that checks call them warnings. */
const MISTAKES: ReadonlySet<string> = new Set([
  "parameter-allowed",
  "parameter-inside",
  "remap-target",
  "wrong-side",
]);

/** Warnings about the engine's own defaults: shown once and not counted, so that other warnings are read. */
const QUIET: ReadonlySet<string> = new Set(["H3", "values-across"]);

/** An input to which the check asks for a value: its path; null for any other problem. */
export function inputOf({ code, where }: CheckedProblem): string | null {
  if (code !== "H7" && code !== "H8") return null;
  const [, path] = /^\/actions\/\d+\/input_parameters\/(.+)$/s.exec(where.path ?? "") ?? [];
  return path ?? null;
}

/**
 * Returns the kind of a problem. `misfits`: whether arrows bring the input something that it cannot take, which is a
 * mistake.
 */
export function kindOf(
  problem: CheckedProblem,
  misfits: (aid: string, path: string) => boolean = () => false,
): ProblemKind {
  const input = inputOf(problem);
  const { aid } = problem.where;
  if (input !== null) return aid !== undefined && misfits(aid, input) ? "wrong" : "fill-in";
  if (UNWRITTEN.has(problem.code)) return "fill-in";
  if (problem.severity === "error" || MISTAKES.has(problem.code)) return "wrong";
  return QUIET.has(problem.code) ? "note" : "warning";
}

/** The number of things of each kind. */
export interface ProblemCounts {
  readonly wrong: number;
  readonly fillIn: number;
  readonly warnings: number;
}

export function countsOf(told: readonly { readonly kind: ProblemKind }[]): ProblemCounts {
  const of = (kind: ProblemKind) => told.filter((each) => each.kind === kind).length;
  return { wrong: of("wrong"), fillIn: of("fill-in"), warnings: of("warning") };
}

/** Returns counts in words, as "1 wrong", "3 to fill in", "2 warnings": those that are not 0, in this order. */
export function countWords({ wrong, fillIn, warnings }: ProblemCounts): string[] {
  return [
    ...(wrong > 0 ? [`${wrong} wrong`] : []),
    ...(fillIn > 0 ? [`${fillIn} to fill in`] : []),
    ...(warnings > 0 ? [counted(warnings, "warning")] : []),
  ];
}
