/** Says actions as people do: one form for all pages, that of the cards. Pure. */
import type { Key } from "./model";
import { shownName } from "./questions";

/** Return the full name of an action, such as `Drive_0`, as people say it: with its number if that is not 0. */
export function spokenName(fullName: string): string {
  const end = endLabel(fullName);
  if (end !== null) return end;
  const [, own, number] = /^(.*)_(\d+)$/s.exec(fullName) ?? [];
  if (own === undefined) return fullName || "an action";
  return number === "0" ? shownName(own) || "an action" : `${shownName(own)} ${number}`;
}

/** Return the name of the entry or the exit; null for an action. */
export function endLabel(key: Key): "Entry" | "Exit" | null {
  return key === "entry" ? "Entry" : key === "exit" ? "Exit" : null;
}
