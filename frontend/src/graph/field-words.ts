/**
 * Words that people read for the fields of a graph, an action and an arrow, one table for the whole
 * page; paths and values of parameters as text. Pure.
 */

import { memberText } from "./json-members";
import type { Parameter } from "./model";

/** Words by the key of a field in the document; a key that stands for itself is not listed. */
const WORDS: Readonly<Record<string, string>> = {
  "": "name",
  actor: "robot",
  instance_id: "number",
  position: "place",
  required: "waits for it",
  breakpoint: "breakpoint",
  on_true: "when true",
  on_false: "when false",
  on_error: "when error",
  on_stopped: "when stopped",
};

/** Fields for the order of things and for how a file listed them: they change along with what people change. */
export const SILENT_FIELDS: ReadonlySet<string> = new Set([
  ...["order", "po", "co", "only", "in", "out", "missing", "twin", "schema"],
]);

/** Return a field as people read it, such as `input pose.x` for `in/pose/x` and `when true` for `on_true`. */
export function fieldWords(field: string): string {
  if (field.startsWith("in/")) return `input ${pathWords(field.slice(3))}`;
  if (field.startsWith("out/")) return `output ${pathWords(field.slice(4))}`;
  if (field.startsWith("ask/")) return `asking for ${pathWords(field.slice(4))}`;
  if (field.startsWith("remap/")) return `remap of ${field.slice(6)}`;
  if (field.startsWith("waypoints/")) return "bends";
  return WORDS[field] ?? field.replace(/^x\//, "").replaceAll("_", " ");
}

/** Return a field without the word "input", where it is plain: values that people set are those of inputs. */
export const plainFieldWords = (field: string): string => fieldWords(field).replace(/^input /, "");

/** Return a value as text of at most `longest` characters, with a sign if it was longer. */
export function shortText(text: string, longest: number): string {
  return text.length > longest ? `${text.slice(0, longest)}…` : text;
}

/** Returns a path as people read it: `pose.position.x` for `pose/position/x`. */
export function pathWords(path: string): string {
  return path
    .split("/")
    .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"))
    .join(".");
}

/** Returns the value as it is spelled; null when there is none. */
export function valueText(parameter: Parameter): string | null {
  const text = parameter.text.trimStart();
  return text.startsWith("{") ? memberText(text, "pvf_value") : text;
}

export interface ParameterLine {
  readonly name: string;
  /** Null: no value of its own. */
  readonly value: string | null;
}

/** Returns the most important inputs, `most` of them: those with a value, then those without. */
export function cardLines(inputs: readonly Parameter[], most: number): ParameterLine[] {
  const lines = inputs.map((input) => ({
    name: pathWords(input.path),
    value: valueText(input)?.replace(/\s+/g, " ") ?? null,
  }));
  const given = lines.filter((line) => line.value !== null);
  const open = lines.filter((line) => line.value === null);
  return [...given, ...open].slice(0, most);
}

export function lineText({ name, value }: ParameterLine): string {
  return value === null ? `${name} = ?` : `${name} = ${value}`;
}
