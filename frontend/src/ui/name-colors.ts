/** Colours of robots by name, and initials of people. */
import { type CSSProperties, useLayoutEffect } from "react";

const COLOURS = 6;
const LONGEST = 64; // letters of a name that its variable has; the rest is hashed

function hash(text: string): number {
  let h = 2166136261;
  for (let i = 0; i < text.length; i += 1) h = Math.imul(h ^ text.charCodeAt(i), 16777619);
  return h >>> 0;
}

const own = (name: string): number => hash(name) % COLOURS;

/** Return the CSS variable that says which colour a name has where its own one is taken. */
function variableOf(name: string): `--name-${string}` {
  const units = Array.from(name.slice(0, LONGEST), (unit) => unit.codePointAt(0)?.toString(16));
  return `--name-${units.join("-")}${name.length > LONGEST ? `_${hash(name).toString(16)}` : ""}`;
}

/**
 * Return the numbers of colours by name. Six names have six colours; of more, each colour has about
 * as many. A group keeps its colours whatever names come in later groups, and their order within it
 * changes nothing. A name has its own colour, if no other one has that first.
 */
export function colorNumbers(groups: readonly (readonly string[])[]): Map<string, number> {
  const found = new Map<string, number>();
  const used = new Array<number>(COLOURS).fill(0);
  const give = (name: string, color: number) => {
    found.set(name, color);
    used[color] = (used[color] ?? 0) + 1;
  };
  for (const group of groups) {
    const names = [...new Set(group)].filter((name) => name !== "" && !found.has(name)).sort();
    for (const name of names) if (used[own(name)] === 0) give(name, own(name));
    for (const name of names) {
      if (found.has(name)) continue;
      const least = Math.min(...used);
      let color = own(name);
      while (used[color] !== least) color = (color + 1) % COLOURS;
      give(name, color);
    }
  }
  return found;
}

/** Return the colour of each of these names among each other; for pictures that leave the page. */
export function colorsAmong(names: readonly string[]): (name: string) => string {
  const numbers = colorNumbers([names]);
  return (name) => (name === "" ? "var(--ink4)" : `var(--robot-${numbers.get(name) ?? own(name)})`);
}

/** Return the colour of a name: the one that `useNameColors` or `nameColors` has chosen, else its own. */
export function colorOfName(name: string): string {
  return name === "" ? "var(--ink4)" : `var(${variableOf(name)}, var(--robot-${own(name)}))`;
}

function variables(groups: readonly (readonly string[])[]): [string, string][] {
  return [...colorNumbers(groups)].map(([name, n]) => [variableOf(name), `var(--robot-${n})`]);
}

/** Return the style of an element in which these names have different colours. */
export function nameColors(names: readonly string[]): CSSProperties {
  return Object.fromEntries(variables([names]));
}

/** The names that parts of the page show now: those with a lower rank keep their colours. */
const shown = new Set<{ rank: number; names: readonly string[] }>();
let written: readonly string[] = [];

function write(): void {
  const { style } = document.documentElement;
  const groups = [...shown].sort((a, b) => a.rank - b.rank).map(({ names }) => names);
  const fresh = variables(groups);
  const kept = new Set(fresh.map(([variable]) => variable));
  for (const variable of written) if (!kept.has(variable)) style.removeProperty(variable);
  for (const [variable, color] of fresh) style.setProperty(variable, color);
  written = [...kept];
}

/** The order in which names choose: the actors of the graph first. */
export const NAME_RANK = { actors: 0, run: 1, robots: 2 } as const;

/** Gives these names different colours on the whole page, for as long as the component is shown. */
export function useNameColors(rank: number, names: readonly string[]): void {
  const text = JSON.stringify([...new Set(names)].sort());
  useLayoutEffect(() => {
    const entry = { rank, names: JSON.parse(text) as string[] };
    shown.add(entry);
    write();
    return () => {
      shown.delete(entry);
      write();
    };
  }, [rank, text]);
}

const letters = new Intl.Segmenter(undefined, { granularity: "grapheme" });

/** The first two letters of a name, or those of its first and last word, in any script. */
export function initials(name: string): string {
  const words = name.trim().split(/\s+/);
  const [first = "", last = ""] = [words[0], words.length > 1 ? words.at(-1) : undefined];
  const own = lettersOf(first);
  const found =
    last === "" ? own.slice(0, 2) : [...own.slice(0, 1), ...lettersOf(last).slice(0, 1)];
  return found.join("").toUpperCase() || "?";
}

/** Return the first letter of a name as people count letters, in capitals. */
export function firstLetter(name: string): string {
  return (lettersOf(name.trim())[0] ?? "?").toUpperCase();
}

/** Return the letters of a word as people count them; of a pile of marks only the first few. */
function lettersOf(word: string): string[] {
  const start = word.slice(0, 64);
  return [...letters.segment(start)].map(({ segment }) => segment.slice(0, 12));
}
