/** Fields of actions, arrows and notes as people know them, for who set them. Pure. */
import type { FieldBlame } from "../../api/documents/history";
import { fieldWords, plainValue } from "../../history/difference-words";

/** Order of things and how a file listed them: changed along with what people change. */
const SILENT = new Set([
  "order",
  "po",
  "co",
  "only",
  "in",
  "out",
  "missing",
  "twin",
  "schema",
  "x",
]);
const LOOKS = /^(position|waypoints\/.*|direction)$/;

const NAMES: ReadonlyMap<string, string> = new Map([
  ["", "name"],
  ["actor", "robot"],
  ["instance_id", "number"],
  ["position", "place"],
  ["required", "waits for it"],
  ["on_true", "when true"],
  ["on_false", "when false"],
  ["on_error", "when error"],
  ["on_stopped", "when stopped"],
]);

export function blamedName(field: string): string {
  if (field.startsWith("in/")) return fieldWords(field).replace(/^input /, "");
  if (field.startsWith("waypoints/")) return "bends";
  return NAMES.get(field) ?? fieldWords(field);
}

export function blamedValue(field: string, value: unknown): string {
  if (value === null || value === undefined) return "nothing";
  if (field === "position" && Array.isArray(value)) return value.map(Math.round).join(", ");
  if (typeof value === "boolean") return value ? "yes" : "no";
  const text = plainValue(value);
  if (text === "") return "nothing";
  return text.length > 80 ? `${text.slice(0, 80)}…` : text;
}

/** What is told: names and values first, what only looks otherwise last. */
export function toldFields(fields: readonly FieldBlame[]): FieldBlame[] {
  const rank = ({ field }: FieldBlame) => (field === "" ? 0 : LOOKS.test(field) ? 2 : 1);
  return fields
    .filter(({ field }) => !SILENT.has(field))
    .sort((a, b) => rank(a) - rank(b) || a.field.localeCompare(b.field));
}
