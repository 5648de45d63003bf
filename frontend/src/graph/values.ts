/**
 * Reads values of the document: total functions from anything to a value or nothing.
 *
 * The document can hold whatever some client wrote. A value that does not fit is left where it is
 * and read as if it were absent, here and in `editor/documents/document.py` alike.
 */

import { type Direction, type Position, RESPONSES, type Response } from "./model";

export { isEqual } from "./stop-basics";

const MAX_INSTANCE_ID = 0xffffffff;
const MAX_DEPTH = 64;

export const asText = (value: unknown): string | undefined =>
  typeof value === "string" ? value : undefined;

/** A finite number. Yjs may carry whole numbers as BigInt. */
export function asNumber(value: unknown): number | undefined {
  const number = typeof value === "bigint" ? Number(value) : value;
  return typeof number === "number" && Number.isFinite(number) ? number : undefined;
}

/** A whole number that the engine takes as `instance_id` (32 bits, unsigned). */
export function asInstanceId(value: unknown): number | undefined {
  const number = asNumber(value);
  if (number === undefined || !Number.isInteger(number)) return undefined;
  return number >= 0 && number <= MAX_INSTANCE_ID ? number + 0 : undefined;
}

export function asPosition(value: unknown): Position | undefined {
  if (!Array.isArray(value) || value.length !== 2) return undefined;
  const x = asNumber(value[0]);
  const y = asNumber(value[1]);
  return x === undefined || y === undefined ? undefined : [x, y];
}

/** Reads the direction of drawing. Documents that say nothing, or something unknown, were drawn top down. */
export const asDirection = (value: unknown): Direction => (value === "right" ? "right" : "down");

const responses: ReadonlySet<unknown> = new Set(RESPONSES);
export const asResponse = (value: unknown): Response | undefined =>
  responses.has(value) ? (value as Response) : undefined;

/** Returns the text if it is JSON; undefined when it is none, or nested deeper than 64. */
export function asJsonText(value: unknown): string | undefined {
  if (typeof value !== "string") return undefined;
  try {
    return depth(JSON.parse(value), 0) <= MAX_DEPTH ? value : undefined;
  } catch {
    return undefined;
  }
}

/** A JSON list of texts. */
export function asTextList(value: unknown): readonly string[] | undefined {
  if (typeof value !== "string") return undefined;
  try {
    const list: unknown = JSON.parse(value);
    return Array.isArray(list) && list.every((item) => typeof item === "string") ? list : undefined;
  } catch {
    return undefined;
  }
}

/** Returns how deep values are nested; stops counting once it is too deep. */
function depth(value: unknown, above: number): number {
  if (typeof value !== "object" || value === null || above > MAX_DEPTH) return above;
  let deepest = above + 1;
  for (const inner of Array.isArray(value) ? value : Object.values(value)) {
    deepest = Math.max(deepest, depth(inner, above + 1));
  }
  return deepest;
}

/** Order of texts by UTF-16 code units, on both sides of the wire. */
export const byText = (a: string, b: string): number => (a < b ? -1 : a > b ? 1 : 0);
