/**
 * Turns parameters into rows of a table; a pose is one row, and unknown members of the JSON are
 * listed. Pure.
 */

import { pathWords } from "../graph/field-words";
import { memberNames, memberText } from "../graph/json-members";
import type { Parameter } from "../graph/model";
import { blocksOf } from "../graph/parameters/groups";
import { allowedLines, parameterValueOf } from "../graph/parameters/values";

export interface ParameterFacts {
  readonly path: string;
  readonly name: string;
  readonly type: string;
  readonly required: boolean;
  /** Allowed values in words; empty: anything. */
  readonly allowed: string;
  /** The value as it is written; null: none. */
  readonly value: string | null;
  /** Further members, such as `unit m`. */
  readonly more: readonly string[];
}

const TOLD = new Set([
  "pvf_type",
  "pvf_value",
  "pvf_required",
  "pvf_allowed_values",
  "pvf_updatable",
]);

/** Return a JSON string without its quotes, any other JSON as it is. */
function plain(text: string): string {
  return text.startsWith('"') ? String(JSON.parse(text)) : text;
}

function moreOf(text: string, locked: boolean): string[] {
  const others = memberNames(text).flatMap((name) => {
    const value = TOLD.has(name) ? null : memberText(text, name);
    return value === null
      ? []
      : [`${name.replace(/^pvf_/, "").replaceAll("_", " ")} ${plain(value)}`];
  });
  return locked ? [...others, "locked"] : others;
}

function factsOf({ path, text }: Parameter): ParameterFacts {
  const field = parameterValueOf(text);
  return {
    path,
    name: pathWords(path),
    type: field.type ?? "no type",
    required: field.required,
    allowed: allowedLines(field).split("\n").filter(Boolean).join(", "),
    value: field.type === null ? null : field.value && plain(field.value),
    more: field.type === null ? [] : moreOf(text, field.locked),
  };
}

/** Return one row for each parameter, and one for all members of a pose or the like. */
export function parameterFacts(list: readonly Parameter[]): ParameterFacts[] {
  return blocksOf(list).flatMap((block) => {
    if (block.kind === "single") return [factsOf(block.parameter)];
    if (block.kind === "group") return block.members.map(factsOf);
    const members = block.rows.flatMap((row) => row.members.map(({ parameter }) => parameter));
    const fields = members.map(({ text }) => parameterValueOf(text));
    return [
      {
        path: block.prefix,
        name: pathWords(block.prefix.slice(0, -1)),
        type: block.word,
        required: fields.some(({ required }) => required),
        allowed: block.rows.map((row) => row.members.map((m) => m.letter).join(" ")).join(" · "),
        value: fields.every(({ value }) => value !== null)
          ? fields.map(({ value }) => value).join(" ")
          : null,
        more: [
          ...new Set(members.flatMap(({ text }, i) => moreOf(text, fields[i]?.locked ?? false))),
        ],
      },
    ];
  });
}
