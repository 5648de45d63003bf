/** Parameter values as people read them. */
import { memberText } from "../../api/member";
import type { Parameter } from "../../graph/model";

/** `pose/position/x` as `pose.position.x`. */
export function pathWords(path: string): string {
  return path
    .split("/")
    .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"))
    .join(".");
}

/** The value as it is spelled; null when there is none. */
export function valueText(parameter: Parameter): string | null {
  const text = parameter.text.trimStart();
  return text.startsWith("{") ? memberText(text, "pvf_value") : text;
}

/** The first inputs that say something, as `name = value`. */
export function cardLines(inputs: readonly Parameter[], most: number): string[] {
  const lines: string[] = [];
  for (const input of inputs) {
    if (lines.length === most) break;
    const value = valueText(input);
    if (value !== null) lines.push(`${pathWords(input.path)} = ${value.replace(/\s+/g, " ")}`);
  }
  return lines;
}
