/** Names within sentences: a name is written by anybody, and its letters may turn the words around it. */

/** Matches text that is written from right to left, or that sets a direction. */
const TURNS =
  /[\u0590-\u08ff\u200e\u200f\u202a-\u202e\u2066-\u2069\ufb1d-\ufdff\ufe70-\ufefc]|[\u{10800}-\u{10fff}\u{1e800}-\u{1efff}]/u;
/** Matches characters that begin or end an isolate: within one they would end it too early, or never. */
const ISOLATES = /[\u2066-\u2069]/g;

/**
 * Return a name to stand within a text: whatever directions it has end with it, as in a `<bdi>`. For
 * texts that are no elements: titles, labels, notices. A name that turns nothing stays as it is.
 */
export function isolated(name: string): string {
  if (!TURNS.test(name)) return name;
  return `\u2068${isBalanced(name) ? name : name.replace(ISOLATES, "")}\u2069`;
}

/** Return whether all that is isolated within ends within: so it is in words with isolated names. */
function isBalanced(text: string): boolean {
  let open = 0;
  for (const [control] of text.matchAll(ISOLATES)) {
    open += control === "\u2069" ? -1 : 1;
    if (open < 0) return false;
  }
  return open === 0;
}
