/**
 * Examples of old files as values: the twin of `example_of` in `umrf/parameters.py`.
 *
 * Old files spell examples as texts; one that is no value of the type is not made into one.
 */

import { memberText } from "../json-members";
import type { JsonText } from "../model";
import { asJsonText } from "../values";

/** What the `pvf_example` of a parameter without a value would be as its value; null for none. */
export function exampleOf(parameter: JsonText): JsonText | null {
  if (!parameter.trimStart().startsWith("{")) return null;
  if (memberText(parameter, "pvf_value") !== null) return null;
  const kind: unknown = parsed(memberText(parameter, "pvf_type"));
  let text = memberText(parameter, "pvf_example");
  const spelled: unknown = parsed(text);
  if (typeof spelled === "string" && kind !== "string") text = spelled.trim();
  const value = parsed(text);
  if (text === null || typeof kind !== "string" || !fits(kind, value)) return null;
  const allowed: unknown = parsed(memberText(parameter, "pvf_allowed_values"));
  const isAllowed = (each: unknown) => JSON.stringify(each) === JSON.stringify(value);
  if (Array.isArray(allowed) && allowed.length > 0 && !allowed.some(isAllowed)) return null;
  return text;
}

function parsed(text: string | null): unknown {
  return text === null || asJsonText(text) === undefined ? undefined : JSON.parse(text);
}

/** Whether the engine can read a value of a native type; of other types it reads none. */
function fits(kind: string, value: unknown): boolean {
  switch (kind) {
    case "string":
      return typeof value === "string";
    case "number":
      return typeof value === "number" && Number.isFinite(value);
    case "bool":
      return typeof value === "boolean";
    case "strings":
    case "numbers":
    case "bools":
      return Array.isArray(value) && value.every((each) => fits(kind.slice(0, -1), each));
    default:
      return false;
  }
}
