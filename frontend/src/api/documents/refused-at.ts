/** What a refusal says of its place besides where in a text. */
import { Refusal } from "../http";

/** It, as `code` or `graph`; empty where it says nothing. */
export function refusedAt(error: unknown, name: "code" | "graph"): string {
  if (!(error instanceof Refusal)) return "";
  const where: Readonly<Record<string, unknown>> = { ...error.details.where };
  const said = where[name];
  return typeof said === "string" ? said : "";
}
