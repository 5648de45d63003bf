/** Parameter values by their type: from JSON text to what is typed, and back. Pure. */

import { memberText, withMember } from "../json-members";

export const TYPES = ["string", "number", "bool", "strings", "numbers", "bools"] as const;
export type PvfType = (typeof TYPES)[number];

export interface ParameterValue {
  /** The type as the file spells it; null when the text is no parameter of a type. */
  readonly type: string | null;
  readonly native: PvfType | null;
  /** JSON text of the value; null when there is none. */
  readonly value: string | null;
  readonly allowed: readonly string[];
  readonly required: boolean;
  readonly locked: boolean;
}

function json(text: string | null): unknown {
  if (text === null) return undefined;
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}

/** Returns the items of a list as they are spelled; empty when it is no list. */
function itemsOf(text: string | null): string[] {
  const list = json(text);
  if (text === null || !Array.isArray(list)) return [];
  const spelled = text.trim().slice(1, -1).split(",");
  const plain = list.every((item) => typeof item === "number") && spelled.length === list.length;
  return plain ? spelled.map((item) => item.trim()) : list.map((item) => JSON.stringify(item));
}

export function parameterValueOf(text: string): ParameterValue {
  const none = { native: null, allowed: [], required: true, locked: false } as const;
  if (!text.trimStart().startsWith("{")) return { ...none, type: null, value: text };
  const type = json(memberText(text, "pvf_type"));
  const native = TYPES.find((known) => known === type) ?? null;
  const allowed = itemsOf(memberText(text, "pvf_allowed_values"));
  return {
    type: typeof type === "string" ? type : null,
    native,
    value: memberText(text, "pvf_value"),
    allowed,
    required: json(memberText(text, "pvf_required")) !== false,
    locked: json(memberText(text, "pvf_updatable")) === false,
  };
}

/** Returns the parameter with this JSON text as its value; without a value for null. */
export function withValue(text: string, value: string | null): string {
  return withMember(text, "pvf_value", value);
}

/** Returns the parameter with another type; a value that does not fit the type is removed. */
export function withType(text: string, type: string): string {
  const next = withMember(text, "pvf_type", JSON.stringify(type));
  const field = parameterValueOf(next);
  if (field.native === null || field.value === null) return next;
  const draft = shown(field);
  return complaint(field, draft) === null && fitsType(field.native, json(field.value))
    ? next
    : withMember(next, "pvf_value", null);
}

function fitsType(type: PvfType, value: unknown): boolean {
  switch (type) {
    case "string":
    case "number":
      return typeof value === type;
    case "bool":
      return typeof value === "boolean";
    case "strings":
    case "numbers":
    case "bools":
      return Array.isArray(value);
  }
}

/** Returns the parameter with other allowed values, one on each line of `draft`; with none, everything is allowed. */
export function withAllowed(text: string, draft: string): Typed {
  const field = parameterValueOf(text);
  const item = field.native?.replace(/s$/, "");
  const items: string[] = [];
  for (const line of lines(draft)) {
    if (item === "number" || item === "bool") {
      const typed = single(item, line);
      if ("wrong" in typed) return typed;
      items.push(typed.ok ?? "null");
    } else items.push(JSON.stringify(line));
  }
  const list = items.length === 0 ? null : `[${items.join(", ")}]`;
  return { ok: withMember(text, "pvf_allowed_values", list) };
}

/** Returns the allowed values, one on each line. */
export function allowedLines(field: ParameterValue): string {
  return field.allowed
    .map((item) => (typeof json(item) === "string" ? String(json(item)) : item))
    .join("\n");
}

/** Sets whether the action needs a value when it runs. True is what the engine assumes. */
export const withRequired = (text: string, required: boolean): string =>
  withMember(text, "pvf_required", required ? null : "false");

/** Locks the value, so that outputs of other actions never replace it, or unlocks it. */
export const withLock = (text: string, locked: boolean): string =>
  withMember(text, "pvf_updatable", locked ? "false" : null);

/** Returns the text of a field for a value: lists have a line for each item. */
export function shown(field: ParameterValue): string {
  const value = json(field.value);
  if (field.native === "string") return typeof value === "string" ? value : (field.value ?? "");
  if (field.native === "strings" && Array.isArray(value)) {
    return value.map((item) => (typeof item === "string" ? item : JSON.stringify(item))).join("\n");
  }
  if (field.native === "numbers" || field.native === "bools") {
    const inner = field.value?.trim().replace(/^\[|\]$/g, "") ?? "";
    return inner
      .split(",")
      .map((item) => item.trim())
      .join("\n");
  }
  return field.value ?? "";
}

const NUMBER = /^-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?$/;

function lines(draft: string): string[] {
  return draft
    .split("\n")
    .map((line) => line.trim())
    .filter((line) => line !== "");
}

type Typed = { readonly ok: string | null } | { readonly wrong: string };

/** `1,5`, `.5` and `5.` are what people type; JSON wants `1.5`, `0.5` and `5.0`. */
function numberText(draft: string): string | null {
  const text = draft
    .trim()
    .replace(/^(-?)\./, "$10.")
    .replace(/\.$/, ".0")
    .replace(/^\+/, "");
  return NUMBER.test(text) && Number.isFinite(Number(text)) ? text : null;
}

function single(type: "number" | "bool", draft: string): Typed {
  if (type === "number") {
    const text = numberText(draft);
    return text === null ? { wrong: `“${draft.trim()}” is no number.` } : { ok: text };
  }
  const text = draft.trim().toLowerCase();
  return text === "true" || text === "false"
    ? { ok: text }
    : { wrong: `“${draft.trim()}” is neither true nor false.` };
}

function listed(type: "numbers" | "bools", draft: string): Typed {
  const items: string[] = [];
  for (const line of lines(draft)) {
    const item = single(type === "numbers" ? "number" : "bool", line);
    if ("wrong" in item) return item;
    items.push(item.ok ?? "");
  }
  return { ok: `[${items.join(", ")}]` };
}

/** The JSON text of what was typed; null for an empty field, which has no value. */
export function typed(type: PvfType, draft: string): Typed {
  switch (type) {
    case "string":
      return { ok: JSON.stringify(draft) };
    case "strings":
      return { ok: draft === "" ? null : JSON.stringify(lines(draft)) };
    case "numbers":
    case "bools":
      return draft.trim() === "" ? { ok: null } : listed(type, draft);
    case "number":
    case "bool":
      return draft.trim() === "" ? { ok: null } : single(type, draft);
  }
}

/** Returns what is wrong with a draft of a field; null when it may be written. */
export function complaint(field: ParameterValue, draft: string): string | null {
  if (field.native === null) return null;
  const result = typed(field.native, draft);
  if ("wrong" in result) return result.wrong;
  if (result.ok === null || field.allowed.length === 0) return null;
  const fits = field.allowed.some((item) => json(item) === json(result.ok));
  return fits ? null : `Allowed: ${field.allowed.join(", ")}.`;
}

/** The choices for a new parameter: a type, or a group of several. */
export const GROUPS: Readonly<Record<string, readonly string[]>> = {
  point: ["x", "y", "z"],
  pose: [
    ...["x", "y", "z"].map((axis) => `position/${axis}`),
    ...["x", "y", "z", "w"].map((axis) => `orientation/${axis}`),
  ],
};

/** The text of a new parameter of a type. */
export function fresh(type: string): string {
  return JSON.stringify({ pvf_type: type });
}
