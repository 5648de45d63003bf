/**
 * Finds where two runs differ first and the likely cause, in words. Durations differ only if their
 * ranges do not overlap. Pure.
 */

import { CONDUCTED, engineWords } from "../api/led-runs";
import type { ComparedField, ComparedStep, Comparison } from "../api/review";
import type { Visit } from "../api/runs";
import { plainValue } from "../differences/difference-words";
import { spokenName } from "../graph/spoken-name";
import { spokenText } from "../graph/spoken-text";
import { boundsText } from "../status/durations";
import { INTO, wayWords } from "../status/level-places";
import { visitDuration } from "../status/progress";
import { valueLines } from "../status/value-words";
import { isolated } from "../words/isolated";

/** Duration as a range, ms; `most` is Infinity if nothing bounds it. */
export interface DurationRange {
  readonly least: number;
  readonly most: number;
}

/** Summary of an action in one run. */
export interface ActionSummary {
  /** `true`, `false`, `error`, `stopped`, or `unknown`, in the order of its visits. */
  readonly results: readonly string[];
  /** The number of these results that persons gave by word; missing where no person did. */
  readonly said?: number;
  /** All its visits together; null where an end was not seen. */
  readonly took: DurationRange | null;
}

export interface ComparedAction extends LevelPlaceInWords {
  readonly aid: string | null;
  /** Name by which the engine reports the action. */
  readonly name: string;
  /** The action that it is right inside of, as the engine told that. */
  readonly around: string | null;
  /** Set if other actions ran inside of it. */
  readonly holds: boolean;
  /** Null: it did not run. */
  readonly a: ActionSummary | null;
  readonly b: ActionSummary | null;
}

function rangeOf(visit: Visit): DurationRange | null {
  const { took, atMost } = visitDuration(visit);
  return took === null ? null : { least: took, most: atMost ?? took };
}

function summaryOf(visits: readonly Visit[]): ActionSummary | null {
  if (visits.length === 0) return null;
  const ranges = visits.map(rangeOf);
  const known = ranges.every((range) => range !== null);
  const said = visits.filter((visit) => visit.said).length;
  return {
    results: visits.map(({ result }) => result ?? "unknown"),
    ...(said > 0 ? { said } : {}),
    took: known
      ? {
          least: ranges.reduce((sum, range) => sum + range.least, 0),
          most: ranges.reduce((sum, range) => sum + range.most, 0),
        }
      : null,
  };
}

interface LevelPlaceInWords {
  readonly levels: readonly string[];
  /** Its own name on its level. */
  readonly label: string;
}

const keyOf = (way: readonly string[]): string => JSON.stringify(way);

/** Each action once, in the order in which they began, and right below each those inside of it. */
export function comparedActions(found: Comparison): ComparedAction[] {
  const steps = new Map<string, ComparedStep[]>();
  for (const step of found.steps) {
    const key = keyOf([...step.levels, step.name]);
    const known = steps.get(key);
    if (known === undefined) steps.set(key, [step]);
    else known.push(step);
  }
  const inside = new Map<string, ComparedStep[][]>();
  for (const all of steps.values()) {
    const levels = keyOf(all[0]?.levels ?? []);
    const around = steps.has(levels) ? levels : keyOf([]);
    inside.set(around, [...(inside.get(around) ?? []), all]);
  }
  const put = (way: string, around: string | null): ComparedAction[] =>
    (inside.get(way) ?? []).flatMap((all) => {
      const [{ action, levels, name: label, aid } = NO_STEP] = all;
      const own = keyOf([...levels, label]);
      const [a, b] = [all.flatMap((each) => each.a ?? []), all.flatMap((each) => each.b ?? [])];
      const place = { name: action, levels, label, aid, around, holds: inside.has(own) };
      return [{ ...place, a: summaryOf(a), b: summaryOf(b) }, ...put(own, action)];
    });
  return put(keyOf([]), null);
}

const NO_STEP = { action: "", levels: [], name: "", aid: null };

/** The identity of the outermost action around a step, or of its own: the one on the canvas. */
export function outermostAid(found: Comparison, { levels, aid }: ComparedStep): string | null {
  const [outermost] = levels;
  if (outermost === undefined) return aid;
  const around = found.steps.find((each) => each.levels.length === 0 && each.name === outermost);
  return around?.aid ?? null;
}

export function rangeText(range: DurationRange | null): string {
  if (range === null) return "no end seen";
  const most = range.most === Number.POSITIVE_INFINITY ? null : range.most / 1000;
  return boundsText({ least: range.least / 1000, most }) ?? "not known how long";
}

export function overlap(a: DurationRange, b: DurationRange): boolean {
  return a.least <= b.most && b.least <= a.most;
}

export interface NumberedDifference {
  /** 1 is the first one: where the runs part. */
  readonly number: number;
  readonly step: ComparedStep;
  readonly title: string;
  readonly text: string;
}

function ended(visit: Visit): string {
  if (visit.result === null) return visit.until === null ? "went on" : "ended, result not known";
  return visit.result === "error" ? "ended with an error" : `ended ${visit.result}`;
}

function visitWords(step: ComparedStep): string {
  return step.visit > 1 ? `${wayWords(step)}, visit ${step.visit},` : wayWords(step);
}

function differenceOf(
  step: ComparedStep,
  found: Comparison,
): Pick<NumberedDifference, "title" | "text"> {
  const [a, b] = [`run ${found.a.number}`, `run ${found.b.number}`];
  const [one, other] = [step.a, step.b];
  const who = visitWords(step);
  if (one === null || other === null) {
    const ran = one ?? other;
    const [where, not] = one === null ? [b, a] : [a, b];
    const did = ran === null ? "" : ` and ${ended(ran)} after ${rangeText(rangeOf(ran))}`;
    const again = step.visit > 1 ? " again" : "";
    const text = `In ${where} it ran${again}${did}; in ${not} it did not.`;
    return { title: `${isolated(who)} ran only in ${where}`, text };
  }
  const slower =
    step.slower === null || step.slower === undefined
      ? ""
      : ` Clearly longer in ${step.slower === "a" ? a : b}.`;
  return {
    title: `${who} ${ended(other)}`,
    text: `After ${rangeText(rangeOf(other))}. In ${a} it ${ended(one)} after ${rangeText(rangeOf(one))}.${slower}`,
  };
}

const DIFFERS: ReadonlySet<string> = new Set(["result", "only_a", "only_b"]);

/** Return the proven differences, from the first one on. */
export function differencesOf(found: Comparison): NumberedDifference[] {
  return found.steps
    .filter(({ relation }) => DIFFERS.has(relation))
    .map((step, i) => ({ number: i + 1, step, ...differenceOf(step, found) }));
}

/** Actions that ended the same, and for which no difference in time is claimed. */
export function sameAsSeen(found: Comparison): { name: string; text: string }[] {
  return comparedActions(found).flatMap(({ name, levels, label, a, b }) => {
    const steps = found.steps.filter(({ action }) => action === name);
    const same = steps.every(({ relation, slower }) => relation === "same" && !slower);
    if (!same || !a?.took || !b?.took) return [];
    if (!overlap(a.took, b.took)) return [];
    const [x, y] = [rangeText(b.took), rangeText(a.took)];
    const text = x === y ? `${x} in both` : `${x} and ${y} overlap: no difference is claimed`;
    return [{ name: wayWords({ levels, name: label }), text }];
  });
}

function changedWords({ field, before, after }: ComparedField): string {
  const name = field.replace(/^(in|out)\//, "");
  return `its ${isolated(name)} was ${plainValue(after)} instead of ${plainValue(before)}`;
}

/**
 * Return the parameter values that differ between the two visits, as far as engines reported them;
 * null if none do.
 */
function ranWithOther({ a, b }: ComparedStep): string | null {
  const [before, after] = [a?.inputs, b?.inputs];
  if (!before || !after) return null;
  const name = Object.keys(after).find((each) => each in before && before[each] !== after[each]);
  if (name === undefined) return null;
  const [was, is] = [plainValue(before[name]), plainValue(after[name])];
  return `it ran with ${name.replaceAll("::", " / ")} ${is} instead of ${was}`;
}

/**
 * Fields of a relation that decide whether it runs the next action; waypoints and its position in a
 * list do not.
 */
const ARROW_DECIDES = /^(on_|required$|remap\/)/;

/**
 * Return the most likely cause of the difference: an event on the way (a person's first), else the
 * nearest earlier difference; null if none is known.
 */
export function likelyCause(found: Comparison): string | null {
  if (found.because) return spokenOf(found, found.because.text);
  const { parting } = found;
  if (parting === null) return null;
  const { step } = parting;
  const level = step.levels.at(-1)?.replace(/_\d+$/, "");
  if (level !== undefined && found.subgraphs.includes(level))
    return `the graph inside ${step.levels.map(spokenName).join(INTO)} was another one`;
  const own = found.graph.actions.find(({ aid }) => step.aid !== null && aid === step.aid);
  // Values of an action explain how it ended, not that it did not run.
  const both = step.a !== null && step.b !== null;
  const field = both ? own?.fields.find(({ field }) => /^(in|out)\//.test(field)) : undefined;
  if (field !== undefined) return changedWords(field);
  const input = ranWithOther(step);
  if (input !== null) return input;
  if (own !== undefined && own.change !== "changed")
    return `${isolated(own.name)} was ${own.change}`;
  const led = found.graph.relations.find(
    ({ child, change, fields }) =>
      child === step.action &&
      (change !== "changed" || fields.some(({ field }) => ARROW_DECIDES.test(field))),
  );
  if (led !== undefined)
    return `the arrow ${isolated(led.parent)} → ${isolated(led.child)} was ${led.change}`;
  return engineDifference(found);
}

/** Return how two runs differ in what carried them out, as a clause; null if they do not. */
export function engineDifference({ a, b }: Pick<Comparison, "a" | "b">): string | null {
  const [one, other] = [engineWords(a), engineWords(b)];
  if (one !== other) return `they ran on ${one} and on ${other}`;
  if (a.engine === b.engine) return null;
  const [led, not] = a.engine === CONDUCTED ? [a, b] : [b, a];
  return `run ${led.number} was led action by action, and run ${not.number} was not`;
}

/** Return a sentence about two runs with the names of actions as people say them. */
export function spokenOf(found: Pick<Comparison, "steps">, text: string): string {
  const known = new Set(found.steps.flatMap(({ name, levels }) => [name, ...levels]));
  return spokenText(text, known);
}

/** The likely cause as a sentence, or that there is none. */
export function causeSentence(found: Comparison): string | null {
  const cause = likelyCause(found);
  if (found.parting === null)
    return cause === null ? null : `${cause.charAt(0).toUpperCase()}${cause.slice(1)}.`;
  if (cause !== null) return `Likely because ${cause}.`;
  const sameEngine = engineDifference(found) === null;
  const same = found.same_graph && sameEngine && found.subgraphs.length === 0;
  return same && valueDifferences(found).length === 0
    ? "Nothing that is known differed before."
    : "Nothing that differed before is known to explain it.";
}

/** A value of the start of one of two runs that the other does not have. */
export interface ValueDifference {
  readonly place: string;
  readonly words: string;
  /** JSON text; null: nothing was set. */
  readonly a: string | null;
  readonly b: string | null;
}

/** Return the values with which two runs were started, where they differ. */
export function valueDifferences({ a, b }: Pick<Comparison, "a" | "b">): ValueDifference[] {
  const [ofA, ofB] = [a, b].map(
    ({ values }) => new Map(valueLines(values).map((line) => [line.place, line])),
  );
  return [...new Map([...(ofA ?? []), ...(ofB ?? [])])]
    .map(([place, { action, input }]) => ({
      place,
      words: `${action} ${input}`,
      a: ofA?.get(place)?.text ?? null,
      b: ofB?.get(place)?.text ?? null,
    }))
    .filter((each) => each.a !== each.b);
}

/** Return in how many visits and in how many values of their starts two runs differ. */
export const differenceCount = (found: Comparison): number =>
  differencesOf(found).length + valueDifferences(found).length;
