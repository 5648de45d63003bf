/**
 * Compares plain values and makes ids, for the page and for STOP, which loads these two functions
 * and nothing else of `graph/`.
 */

/** Returns true if two plain values (objects, arrays, primitives) are equal. */
export function isEqual(a: unknown, b: unknown): boolean {
  if (Object.is(a, b)) return true;
  if (typeof a !== "object" || typeof b !== "object" || a === null || b === null) return false;
  if (Array.isArray(a)) {
    return Array.isArray(b) && a.length === b.length && a.every((item, i) => isEqual(item, b[i]));
  }
  const left = Object.entries(a);
  return (
    left.length === Object.keys(b).length &&
    left.every(([key, value]) => isEqual(value, (b as Record<string, unknown>)[key]))
  );
}

const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";
const LENGTH = 12;
// Bytes from here on would make the first letters likelier than the others.
const FAIR = 256 - (256 % LETTERS.length);

/** Returns a new random id of 12 letters and digits (71 bits). Works without a secure context (plain http on a LAN), unlike `crypto.randomUUID`. */
export function newAid(): string {
  let id = "";
  while (id.length < LENGTH) {
    for (const byte of crypto.getRandomValues(new Uint8Array(LENGTH))) {
      if (byte < FAIR && id.length < LENGTH) id += LETTERS.charAt(byte % LETTERS.length);
    }
  }
  return id;
}
