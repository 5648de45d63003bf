/**
 * Reads keyboard events, as the only module of the page.
 *
 * `KeyboardEvent.key` alone is not enough. On a Cyrillic, Greek or Arabic layout it is a letter of that
 * script, so Ctrl Z never arrives; and while an input method composes a word, its Enter and Escape
 * belong to the input method. `src/tree.test.ts` refuses handlers that read the event themselves.
 */

/** The fields that are read of a keyboard event, of the DOM or of React. */
export interface KeyPress {
  readonly key: string;
  /** The place of the key, as it is named on a US keyboard; empty on most touch screens. */
  readonly code?: string;
  readonly keyCode?: number;
  readonly shiftKey?: boolean;
  readonly isComposing?: boolean;
  readonly nativeEvent?: { readonly isComposing?: boolean };
  getModifierState?(key: "AltGraph"): boolean;
}

/** Signs of a US keyboard, plain and with Shift. */
const SIGNS: ReadonlyMap<string, string> = new Map([
  ["Backquote", "`~"],
  ["Minus", "-_"],
  ["Equal", "=+"],
  ["BracketLeft", "[{"],
  ["BracketRight", "]}"],
  ["Backslash", "\\|"],
  ["Semicolon", ";:"],
  ["Quote", "'\""],
  ["Comma", ",<"],
  ["Period", ".>"],
  ["Slash", "/?"],
  ["Digit1", "1!"],
  ["Digit2", "2@"],
  ["Digit3", "3#"],
  ["Digit4", "4$"],
  ["Digit5", "5%"],
  ["Digit6", "6^"],
  ["Digit7", "7&"],
  ["Digit8", "8*"],
  ["Digit9", "9("],
  ["Digit0", "0)"],
]);

/**
 * Return what a US keyboard types with this key; null for keys that type nothing, and unknown
 * places.
 */
function usCharacter(code: string, shift: boolean): string | null {
  const letter = /^Key([A-Z])$/.exec(code)?.[1];
  if (letter !== undefined) return shift ? letter : letter.toLowerCase();
  return SIGNS.get(code)?.charAt(shift ? 1 : 0) ?? null;
}

/** The last code point of Latin letters and signs: what stands before it is typed on Latin layouts. */
const LAST_LATIN = 0x24f;
const isOtherScript = (key: string) => (key.codePointAt(0) ?? 0) > LAST_LATIN;

/**
 * Return whether the key belongs to an input method that composes a word. Safari ends the
 * composition before it sends the Enter that ended it: only the old `keyCode` of such keys, 229,
 * tells it there.
 */
export function isComposing(event: KeyPress): boolean {
  if (event.isComposing === true || event.nativeEvent?.isComposing === true) return true;
  return event.keyCode === 229 || event.key === "Process";
}

/**
 * Return the name of the key for shortcuts: a named key ("Enter"), a character of a Latin layout as it
 * is typed, and for another script the character that a US keyboard has at that place. A key of an
 * input method is "Process", whatever it is.
 */
export function keyOf(event: KeyPress): string {
  if (isComposing(event)) return "Process";
  const { key, code = "", shiftKey = false } = event;
  const unknown = key === "Unidentified";
  // With AltGr a key types a sign that is meant, such as "…".
  if (!unknown && (!isOtherScript(key) || event.getModifierState?.("AltGraph"))) return key;
  return usCharacter(code, shiftKey) ?? key;
}

/** Return the names of the key, its own character first: shortcuts of one's own may be letters of any script. */
export function keysOf(event: KeyPress): readonly string[] {
  const key = keyOf(event);
  return isComposing(event) || key === event.key ? [key] : [event.key, key];
}

/** Return the character that the key types, empty for named keys and while an input method composes. */
export function typedCharacter(event: KeyPress): string {
  return !isComposing(event) && (event.key.length === 1 || isOtherScript(event.key))
    ? event.key
    : "";
}

/**
 * Return whether this is the key of Stop all, Ctrl . or ⌘ . on every layout: the key that types a full
 * stop, or the key at its place where another script or an input method has something else there. Also
 * while a word is composed: no input method comes before a Stop.
 */
export function isStopKey(
  event: KeyPress & { readonly ctrlKey: boolean; readonly metaKey: boolean },
): boolean {
  if (!event.ctrlKey && !event.metaKey) return false;
  const { key, code } = event;
  if (key === ".") return true;
  if (code === "NumpadDecimal") return key.length === 1; // a comma in many countries
  if (code !== "Period" || event.getModifierState?.("AltGraph")) return false;
  return isOtherScript(key) || isComposing(event) || key === "Unidentified" || key === "Dead";
}
