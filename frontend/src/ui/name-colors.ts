/** Colours of robots by name, the same for everybody, and initials of people. */
const COLOURS = 6;

function hash(text: string): number {
  let h = 2166136261;
  for (let i = 0; i < text.length; i += 1) h = Math.imul(h ^ text.charCodeAt(i), 16777619);
  return h >>> 0;
}

export function colorOfName(name: string): string {
  return name === "" ? "var(--ink4)" : `var(--robot-${hash(name) % COLOURS})`;
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
