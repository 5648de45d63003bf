/** Says the full names of actions in a text as people do. Pure. */
import { spokenName } from "./spoken-name";

/** Replace the full names of actions (`known`) in a text by those that people say. */
export function spokenText(text: string, known: ReadonlySet<string>): string {
  return text.replace(/\b\w+_\d+\b/g, (word) => (known.has(word) ? spokenName(word) : word));
}
