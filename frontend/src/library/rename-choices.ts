/**
 * Finds parameters that may have been renamed only: some are suggested by graphs, and people
 * confirm them. Pure.
 */
import type { ActionUse, Renames } from "../api/library";
import type { ParameterSide } from "../graph/document-keys";
import { memberText } from "../graph/json-members";

/** A possible rename. `graphs`: the number of graphs for which it is possible. */
export interface SuggestedRename {
  readonly side: ParameterSide;
  readonly from: string;
  readonly to: string;
  readonly graphs: number;
}

/** Return a text that identifies a rename. */
export const keyOfRename = ({ side, from, to }: Omit<SuggestedRename, "graphs">): string =>
  `${side} ${from} ${to}`;

/** Return the suggested renames of all graphs, each once, in the order in which they occur. */
export function suggestedRenames(uses: readonly ActionUse[]): SuggestedRename[] {
  const found = new Map<string, SuggestedRename>();
  for (const { suggested } of uses) {
    for (const side of ["in", "out"] as const) {
      for (const [from, to] of side === "in" ? suggested.inputs : suggested.outputs) {
        const key = keyOfRename({ side, from, to });
        found.set(key, { side, from, to, graphs: (found.get(key)?.graphs ?? 0) + 1 });
      }
    }
  }
  return [...found.values()];
}

const typeOf = (text: unknown): string | null =>
  typeof text === "string" && text.trimStart().startsWith("{")
    ? memberText(text, "pvf_type")
    : null;

/** Return the parameters that one graph's actions would lose and gain on this side. */
function wentAndCame({ difference }: ActionUse, side: ParameterSide) {
  const fields = (difference?.actions ?? []).flatMap((action) => action.fields);
  const own = fields.filter(({ field }) => field.startsWith(`${side}/`));
  const path = (field: string) => field.slice(side.length + 1);
  return {
    went: own.flatMap(({ field, before, after }) =>
      after === null ? [{ path: path(field), type: typeOf(before) }] : [],
    ),
    came: own.flatMap(({ field, before, after }) =>
      before === null ? [{ path: path(field), type: typeOf(after) }] : [],
    ),
  };
}

/** Return further renames that are possible by type and that no graph suggests. */
export function possibleRenames(
  uses: readonly ActionUse[],
  suggested: readonly SuggestedRename[],
): SuggestedRename[] {
  const known = new Set(suggested.map(keyOfRename));
  const found = new Map<string, SuggestedRename>();
  for (const use of uses) {
    for (const side of ["in", "out"] as const) {
      const { went, came } = wentAndCame(use, side);
      for (const { path: from, type } of went) {
        for (const { path: to } of came.filter((each) => each.type === type)) {
          const key = keyOfRename({ side, from, to });
          const graphs = (found.get(key)?.graphs ?? 0) + 1;
          if (!known.has(key)) found.set(key, { side, from, to, graphs });
        }
      }
    }
  }
  return [...found.values()];
}

/**
 * Return whether a rename conflicts with those chosen: the same parameter would get two names, or
 * two parameters one.
 */
export function clashes(
  one: SuggestedRename,
  ticked: ReadonlySet<string>,
  all: readonly SuggestedRename[],
): boolean {
  return all.some(
    (other) =>
      other !== one &&
      ticked.has(keyOfRename(other)) &&
      other.side === one.side &&
      (other.from === one.from || other.to === one.to),
  );
}

/** Return the chosen renames as the server takes them. */
export function renamesOf(ticked: ReadonlySet<string>, all: readonly SuggestedRename[]): Renames {
  const of = (side: ParameterSide) =>
    all
      .filter((each) => each.side === side && ticked.has(keyOfRename(each)))
      .map(({ from, to }): [string, string] => [from, to]);
  return { inputs: of("in"), outputs: of("out") };
}
