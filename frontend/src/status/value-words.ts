/** Values of a start in words. Apart from the form, which few pages show. Pure. */
import type { AskedInput, StartValues } from "../api/starts";
import { spokenName } from "../graph/spoken-name";
import { isolated } from "../words/isolated";

/** Return the key of an input of a graph, by full and flat name. */
export const placeOfInput = ({ action, name }: Pick<AskedInput, "action" | "name">): string =>
  JSON.stringify([action, name]);

/** Return the flat name of an input as people read it. */
export const inputWords = (name: string): string => name.replaceAll("::", ".");

/** One value of a start, for people. */
export interface ValueLine {
  readonly place: string;
  readonly action: string;
  readonly input: string;
  /** JSON text. */
  readonly text: string;
}

/** Return the values of a start, one by one. */
export function valueLines(values: StartValues | undefined): ValueLine[] {
  return Object.entries(values ?? {}).flatMap(([action, given]) =>
    Object.entries(given).map(([name, value]) => ({
      place: placeOfInput({ action, name }),
      action: spokenName(action),
      input: inputWords(name),
      text: JSON.stringify(value),
    })),
  );
}

/** Return a value with its place in one text. */
export const lineWords = ({ action, input, text }: ValueLine): string =>
  `${action} ${input} = ${text}`;

/** Return the values of a start in one text; "" for none. */
export const valuesWords = (values: StartValues | undefined): string =>
  valueLines(values)
    .map((line) => isolated(lineWords(line)))
    .join(", ");
