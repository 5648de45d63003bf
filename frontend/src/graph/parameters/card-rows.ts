/** Computes the rows that a card shows of its inputs: one for each, or one for a whole point or pose. Pure. */
import { flatName } from "../document-keys";
import { pathWords } from "../field-words";
import type { Parameter } from "../model";
import { type InputGivers, readValue, takenGivers } from "./data-flow";
import { blocksOf } from "./groups";
import { shown } from "./values";

export interface CardRow {
  readonly name: string;
  /** `seen`: the engine reported it in a run. `open`: it needs a value and has none; `none`: it needs none. */
  readonly kind: "value" | "from" | "open" | "none" | "seen";
  /** The value, or who gives it: `IsValveClosed`, with the output where that is called otherwise. */
  readonly text: string;
}

/** The values that the engine reported, as JSON texts by flat name. */
export type ReportedInputs = Readonly<Record<string, string>>;

const unquoted = (text: string): string => {
  try {
    const value: unknown = JSON.parse(text);
    return typeof value === "string" ? value : text;
  } catch {
    return text; // cut where it was long
  }
};

function rowOf(
  name: string,
  inputs: readonly Parameter[],
  givers: InputGivers | undefined,
  reported: ReportedInputs | null,
): CardRow {
  const seen = inputs.map(({ path }) => reported?.[flatName(path)]);
  if (seen.some((text) => text !== undefined)) {
    return { name, kind: "seen", text: seen.map((text) => unquoted(text ?? "?")).join(" ") };
  }
  const given = inputs.flatMap(({ path }) => takenGivers(givers?.get(path)).slice(0, 1));
  const [giver] = given;
  if (giver) {
    const other = inputs.length === 1 && giver.renamed;
    const output = other ? `.${giver.output.replaceAll("::", ".")}` : "";
    return { name, kind: "from", text: `${giver.parentName}${output}` };
  }
  const values = inputs.map((input) => {
    const field = readValue(input);
    return field.value === null ? null : shown(field).replace(/\s+/g, " ");
  });
  if (values.every((value) => value === null)) {
    const needed = inputs.some((input) => readValue(input).required);
    return needed ? { name, kind: "open", text: "?" } : { name, kind: "none", text: "no value" };
  }
  return { name, kind: "value", text: values.map((value) => value ?? "?").join(" ") };
}

/** Returns the rows of a card: first inputs with a value or a giver, then those that need one, then the others. */
export function cardRows(
  inputs: readonly Parameter[],
  givers?: InputGivers,
  reported: ReportedInputs | null = null,
): CardRow[] {
  const rows = blocksOf(inputs).flatMap((block): CardRow[] => {
    if (block.kind === "single") {
      const { parameter } = block;
      return [rowOf(pathWords(parameter.path), [parameter], givers, reported)];
    }
    if (block.kind === "group") {
      return block.members.map((each) => rowOf(pathWords(each.path), [each], givers, reported));
    }
    const members = block.rows.flatMap((row) => row.members.map(({ parameter }) => parameter));
    return [rowOf(pathWords(block.prefix.slice(0, -1)), members, givers, reported)];
  });
  const rank = ({ kind }: CardRow) => (kind === "open" ? 1 : kind === "none" ? 2 : 0);
  return rows.sort((a, b) => rank(a) - rank(b));
}
