/**
 * Computes the inputs and outputs of a graph where an action of another graph stands for it, like
 * `signature_of_graph` on the server. Pure.
 */
import { ENTRY, EXIT, type Graph, type Key, type Parameter } from "../model";
import { parameterValueOf } from "./values";

/** A parameter of the graph, and the actions inside whose it is. */
export interface InterfaceParameter {
  readonly path: string;
  /** The type; null where the file names none. */
  readonly type: string | null;
  readonly required: boolean;
  readonly of: readonly { readonly key: Key; readonly text: string }[];
  /** Several actions take it, and not as the same type. */
  readonly mixed: boolean;
}

interface GraphInterface {
  readonly inputs: readonly InterfaceParameter[];
  readonly outputs: readonly InterfaceParameter[];
}

type Owner = readonly [key: Key, parameters: readonly Parameter[]];

function joined(owners: readonly Owner[]): InterfaceParameter[] {
  const found = new Map<string, { key: Key; text: string }[]>();
  for (const [key, parameters] of owners)
    for (const { path, text } of parameters)
      found.set(path, [...(found.get(path) ?? []), { key, text }]);
  return [...found].map(([path, of]) => {
    const values = of.map(({ text }) => parameterValueOf(text));
    return {
      path,
      of,
      type: values[0]?.type ?? null,
      required: values.some(({ required }) => required),
      mixed: new Set(values.map(({ type }) => type)).size > 1,
    };
  });
}

/** Inputs are what the first actions have no value for; outputs those of the last exit that has any. */
export function interfaceOf({ actions, relations }: Graph): GraphInterface {
  const known = new Map(
    actions.flatMap((each) => (each.missing ? [] : [[each.key, each] as const])),
  );
  const ordered = [...relations].sort((a, b) => a.childOrder - b.childOrder);
  const entries = ordered.flatMap(({ parent, child }): Owner[] => {
    const action = parent === ENTRY ? known.get(child) : undefined;
    const open = action?.inputs.filter(({ text }) => parameterValueOf(text).value === null) ?? [];
    return action && open.length > 0 ? [[action.key, open]] : [];
  });
  const exits = ordered.flatMap(({ parent, child }): Owner[] => {
    const action = child === EXIT ? known.get(parent) : undefined;
    return action && action.outputs.length > 0 ? [[action.key, action.outputs]] : [];
  });
  return { inputs: joined(entries), outputs: joined(exits.slice(-1)) };
}
