/** Describes differences between two moments of a document in words. Pure. */
import { fieldWords } from "../graph/field-words";
import { memberNames, memberText } from "../graph/json-members";
import { isolated } from "../words/isolated";

/** A field that says something else. */
export interface FieldChange {
  readonly field: string;
  readonly before?: unknown;
  readonly after?: unknown;
}

/** One line of it: null where there is nothing on that side. */
export interface ChangedLine {
  readonly name: string;
  readonly before: string | null;
  readonly after: string | null;
}

/** The value inside a parameter's JSON text, or the text itself. */
export function plainValue(value: unknown): string {
  if (value === null || value === undefined) return "—";
  if (typeof value !== "string") return JSON.stringify(value);
  try {
    const parsed: unknown = JSON.parse(value);
    if (typeof parsed === "object" && parsed !== null && "pvf_value" in parsed) {
      return JSON.stringify(parsed.pvf_value);
    }
    return typeof parsed === "string" ? parsed : value;
  } catch {
    return value;
  }
}

const MEMBERS: Readonly<Record<string, string>> = {
  pvf_type: "type",
  pvf_allowed_values: "allowed",
  pvf_required: "required",
  pvf_updatable: "may be replaced",
};

const memberWord = (member: string): string =>
  MEMBERS[member] ?? member.replace(/^pvf_/, "").replaceAll("_", " ");

const isParameter = (value: unknown): value is string =>
  typeof value === "string" && value.trimStart().startsWith("{");

/** A whole parameter: its type, what else it is, and its value. */
function parameterWords(text: string): string {
  const type = memberText(text, "pvf_type");
  const value = memberText(text, "pvf_value");
  const allowed = memberText(text, "pvf_allowed_values");
  return [
    type === null ? "no type" : plainValue(type),
    ...(memberText(text, "pvf_required") === "false" ? ["optional"] : []),
    ...(allowed === null ? [] : [`one of ${allowed}`]),
    ...(value === null ? [] : [`= ${value}`]),
  ].join(", ");
}

/**
 * Return the members in which a parameter differs; for an added or removed one the parameter as a
 * whole.
 */
export function changedLines({ field, before, after }: FieldChange): ChangedLine[] {
  const name = fieldWords(field);
  const parameter = /^(in|out)\//.test(field);
  if (!parameter || !(isParameter(before) || isParameter(after))) {
    const side = (value: unknown) =>
      value === null || value === undefined ? null : plainValue(value);
    return [{ name, before: side(before), after: side(after) }];
  }
  if (!isParameter(before) || !isParameter(after)) {
    const side = (value: unknown) => (isParameter(value) ? parameterWords(value) : null);
    return [{ name, before: side(before), after: side(after) }];
  }
  const members = [...new Set([...memberNames(before), ...memberNames(after)])];
  const lines = members.flatMap((member) => {
    const [was, is] = [memberText(before, member), memberText(after, member)];
    const spoken = member === "pvf_value" ? name : `${isolated(name)}, ${memberWord(member)}`;
    return was === is ? [] : [{ name: spoken, before: was, after: is }];
  });
  return lines.length > 0 ? lines : [{ name, before, after }];
}

/** Lines of parameters of one group that came or went alike are one: a pose has seven. */
export function linesOf(fields: readonly FieldChange[]): ChangedLine[] {
  const lines = fields.flatMap(changedLines);
  const told = new Map<string, { line: ChangedLine; names: string[] }>();
  for (const line of lines) {
    const isWhole = line.before === null || line.after === null;
    const [, group, rest = ""] = /^((?:in|out)put [^.,]+)\.([^,]+)$/.exec(line.name) ?? [];
    const key =
      isWhole && group !== undefined
        ? `${group} ${line.before} ${line.after}`
        : `${told.size} ${line.name}`;
    const known = told.get(key);
    if (known) known.names.push(rest);
    else
      told.set(key, {
        line: { ...line, name: group && isWhole ? group : line.name },
        names: [rest],
      });
  }
  return [...told.values()].map(({ line, names }) => ({
    ...line,
    name: names[0] === "" || line.name.includes(".") ? line.name : `${line.name}.${braced(names)}`,
  }));
}

const braced = (names: readonly string[]): string =>
  names.length === 1 ? (names[0] ?? "") : `(${names.join(", ")})`;
