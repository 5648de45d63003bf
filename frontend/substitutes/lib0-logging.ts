/**
 * What Yjs needs of lib0/logging, which brings a console of its own with pictures, and validators.
 *
 * Yjs has two lines for people who debug: they come without their colours.
 */

/** Styles, which stand between the words. */
export const BOLD = Symbol();
export const ORANGE = Symbol();
export const RED = Symbol();
export const UNBOLD = Symbol();

const words = (parts: readonly unknown[]) => parts.filter((part) => typeof part !== "symbol");

export function print(...parts: readonly unknown[]): void {
  console.log(...words(parts));
}

export function warn(...parts: readonly unknown[]): void {
  console.warn(...words(parts));
}
