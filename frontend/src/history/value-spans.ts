/** The values that a field has had, one after the other, with what ran while it had each. Pure. */

import type { Version } from "../api/graphs";
import type { FieldBlame, FieldValue } from "../api/history";
import type { ListedRun } from "../api/review";
import { newerFirst } from "../api/sites";
import { plainValue } from "../differences/difference-words";
import { SILENT_FIELDS, shortText } from "../graph/field-words";
import { runLabel } from "../status/progress";
import { counted } from "../words/counted";

export interface ValueSpan {
  readonly value: FieldValue;
  /** The value as text. */
  readonly text: string;
  /** Null: it is no number. */
  readonly number: number | null;
  /** Runs that were started while the field had the value, the oldest first. */
  readonly runs: readonly ListedRun[];
}

function numberOf(value: unknown): number | null {
  const text = plainValue(value);
  const found = /^-?\d/.test(text) ? Number(text) : Number.NaN;
  return Number.isFinite(found) ? found : null;
}

/** A value that the field never showed, since another one, which stayed, was set at the same time. */
export interface OverwrittenValue {
  readonly value: FieldValue;
  /** The value as text; `stayed`: the other one. */
  readonly text: string;
  readonly stayed: string;
}

/** Returns the values of a field that were overwritten at once. `values`: the newest first. */
export function overwrittenOf(field: string, values: readonly FieldValue[]): OverwrittenValue[] {
  return values.flatMap((value) =>
    value.overwritten === true
      ? [{ value, text: blamedValue(field, value.value), stayed: blamedValue(field, value.before) }]
      : [],
  );
}

/**
 * Returns the values that a field had, oldest first, each with the runs that were started with it. `values`: the
 * newest first. Values that were overwritten at once have none.
 */
export function spansOf(
  field: string,
  values: readonly FieldValue[],
  versions: readonly Version[],
  runs: readonly ListedRun[],
): ValueSpan[] {
  const seqOf = new Map(versions.map(({ id, seq }) => [id, seq]));
  const started = runs
    .flatMap((run) => {
      const seq = seqOf.get(run.version ?? "");
      return seq === undefined ? [] : [{ run, seq }];
    })
    .sort((a, b) => newerFirst(b.run, a.run));
  const oldest = values.filter(({ overwritten }) => overwritten !== true).reverse();
  return oldest.map((value, i) => {
    const until = oldest[i + 1]?.seq ?? Number.POSITIVE_INFINITY;
    const its = started.filter(({ seq }) => value.seq <= seq && seq < until);
    return {
      value,
      text: blamedValue(field, value.value),
      number: numberOf(value.value),
      runs: its.map(({ run }) => run),
    };
  });
}

const endOf = (run: ListedRun): string =>
  run.result === null ? runLabel(run).word : run.result.replace(/^on_/, "");

/** Returns numbers of runs in words, as `run 21` or `runs 36–40`; "" for none. */
export function runNumbers(runs: readonly ListedRun[]): string {
  const [first, last] = [runs[0]?.number, runs.at(-1)?.number];
  if (first === undefined) return "";
  return first === last ? `run ${first}` : `runs ${first}–${last}`;
}

const ORDER = ["true", "false", "error", "stopped", "halted"];
const rank = (word: string): number =>
  (ORDER.indexOf(word) + ORDER.length + 1) % (ORDER.length + 1);

const seconds = (s: number): string => (s < 10 ? s.toFixed(1) : s.toFixed(0));

/** `22–25 s`: from the quickest that may be to the slowest; "" where some of it is not known. */
function tookWords(runs: readonly ListedRun[]): string {
  const took = runs.flatMap((run) => (run.ended_at !== null && run.took ? [run.took] : []));
  const most = took.map((each) => each.most);
  if (took.length === 0 || most.includes(null)) return "";
  const from = seconds(Math.min(...took.map((each) => each.least)));
  const to = seconds(Math.max(...most.map((each) => each ?? 0)));
  return from === to ? `${to} s` : `${from}–${to} s`;
}

export interface ValueFact {
  readonly text: string;
  readonly words: string;
}

/**
 * Return facts about each value that was run with, such as `5 runs, 4 true, 1 error; 22–25 s`,
 * newest value first.
 */
export function factsOf(spans: readonly ValueSpan[]): ValueFact[] {
  const of = new Map<string, ListedRun[]>();
  for (const { text, runs } of [...spans].reverse()) {
    of.set(text, [...(of.get(text) ?? []), ...runs]);
  }
  return [...of].flatMap(([text, runs]) => {
    if (runs.length === 0) return [];
    const ends = new Map<string, number>();
    for (const run of runs) ends.set(endOf(run), (ends.get(endOf(run)) ?? 0) + 1);
    const told = [...ends]
      .sort(([a], [b]) => rank(a) - rank(b))
      .map(([word, n]) => (runs.length === 1 ? word : `${n} ${word}`));
    const count = counted(runs.length, "run");
    const took = tookWords(runs);
    const proves = runs.length === 1 ? ". One run proves little." : ".";
    return [{ text, words: `${[count, ...told].join(", ")}${took && `; ${took}`}${proves}` }];
  });
}

const LOOKS = /^(position|waypoints\/.*|direction)$/;

export function blamedValue(field: string, value: unknown): string {
  if (value === null || value === undefined) return "nothing";
  if (field === "position" && Array.isArray(value)) return value.map(Math.round).join(", ");
  if (typeof value === "boolean") return value ? "yes" : "no";
  const text = plainValue(value);
  if (text === "") return "nothing";
  return shortText(text, 80);
}

/** Return the fields to show: names and values first, those of looks only last. */
export function toldFields(fields: readonly FieldBlame[]): FieldBlame[] {
  const rank = ({ field }: FieldBlame) => (field === "" ? 0 : LOOKS.test(field) ? 2 : 1);
  return fields
    .filter(({ field }) => !SILENT_FIELDS.has(field) && field !== "x")
    .sort((a, b) => rank(a) - rank(b) || a.field.localeCompare(b.field));
}
