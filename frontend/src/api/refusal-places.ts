/** Where a refusal points: at a place in a file, in the body of a request, or at one of its details. */
import { Refusal } from "./http";

/**
 * Return the place in a file that a refusal points at, in words; empty if it points nowhere or its
 * message says it.
 */
export function errorPlace(error: unknown): string {
  if (!(error instanceof Refusal)) return "";
  const words = placeInFile(error);
  return error.message.includes(words) ? "" : words;
}

/** Return the JSON pointer in the body of a request at which a refusal points; "" if at none. */
export function pathRefused(error: unknown): string {
  return error instanceof Refusal ? (error.details.where?.path ?? "") : "";
}

function placeInFile(error: Refusal): string {
  const where = error.details.where;
  if (where?.line !== undefined) {
    return `line ${where.line}${where.column === undefined ? "" : `, column ${where.column}`}`;
  }
  return where?.path ? `at ${where.path}` : "";
}

/** Return one detail of a refusal, `code` or `graph`; empty if it has none. */
export function refusedAt(error: unknown, name: "code" | "graph"): string {
  if (!(error instanceof Refusal)) return "";
  const where: Readonly<Record<string, unknown>> = { ...error.details.where };
  const said = where[name];
  return typeof said === "string" ? said : "";
}
