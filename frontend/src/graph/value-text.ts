/** Parameter values as people read them. */
import { memberText } from "./json-members";
import type { Parameter } from "./model";

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
