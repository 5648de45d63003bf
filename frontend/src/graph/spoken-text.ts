/** Says the full names of actions in a text as people do. Pure. */
import { spokenName } from "./field-words";

/** Replace the full names of actions (`known`) in a text by those that people say. */
export function spokenText(
  text: string,
  known: ReadonlySet<string>,
  spoken: (fullName: string) => string = spokenName,
): string {
  return text.replace(/\b\w+_\d+\b/g, (word) => (known.has(word) ? spoken(word) : word));
}
