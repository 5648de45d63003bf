/** Lists the outputs of an action and the inputs of the next that they can reach, with reasons. Pure. */
import { flatName } from "../../graph/document-keys";
import type { Action, Parameter, Remap } from "../../graph/model";
import { parameterValueOf } from "../../graph/parameters/values";
import { isolated } from "../../words/isolated";

/** One end of a renaming as a choice; `reason` says why it cannot be chosen. */
export interface RemapChoice {
  readonly name: string;
  readonly type: string | null;
  readonly reason: string | null;
}

const typeOf = (parameter: Parameter): string | null => parameterValueOf(parameter.text).type;

const named = (list: readonly Parameter[] | undefined, name: string): Parameter | undefined =>
  list?.find((parameter) => flatName(parameter.path) === name);

/** The outputs that are not renamed yet. */
export function sources(parent: Action | undefined, remap: readonly Remap[]): RemapChoice[] {
  return (parent?.outputs ?? []).map((output) => {
    const name = flatName(output.path);
    const known = remap.find(({ source }) => source === name);
    const reason = known === undefined ? null : `already reaches it as ${known.target}`;
    return { name, type: typeOf(output), reason };
  });
}

/** The inputs, for an output of this type; null where that is not known. */
export function targets(
  child: Action | undefined,
  remap: readonly Remap[],
  type: string | null,
): RemapChoice[] {
  return (child?.inputs ?? []).map((input) => {
    const name = flatName(input.path);
    const field = parameterValueOf(input.text);
    const known = remap.find(({ target }) => target === name);
    let reason: string | null = null;
    if (type !== null && field.type !== type)
      reason = `takes ${field.type ?? "no type"}, not ${type}`;
    else if (field.locked) reason = "is locked";
    else if (known !== undefined) reason = `already gets ${known.source}`;
    return { name, type: field.type, reason };
  });
}

/** Returns what the engine does with a renaming that does not fit; null when it fits. */
export function misfit(
  parent: Action | undefined,
  child: Action | undefined,
  { source, target }: Remap,
): string | null {
  const output = named(parent?.outputs, source);
  const input = named(child?.inputs, target);
  if (parent !== undefined && output === undefined) {
    return `${isolated(parent.name)} has no output ${source}: the engine breaks down here.`;
  }
  if (child !== undefined && input === undefined)
    return `${isolated(child.name)} has no parameter ${target}: the renaming does nothing.`;
  if (output === undefined || input === undefined) return null;
  const [from, to] = [parameterValueOf(output.text), parameterValueOf(input.text)];
  if (from.type !== to.type) {
    return `${target} takes ${to.type ?? "no type"}, not ${from.type ?? "no type"}: the renaming does nothing.`;
  }
  return to.locked ? `${target} is locked: the renaming does nothing.` : null;
}

/** The outputs that reach an input because both are called the same, and fit. */
export function passed(
  parent: Action | undefined,
  child: Action | undefined,
  remap: readonly Remap[],
): string[] {
  return (parent?.outputs ?? []).flatMap((output) => {
    const name = flatName(output.path);
    const renamed = remap.some(({ source, target }) => source === name || target === name);
    const input = named(child?.inputs, name);
    if (renamed || input === undefined || parameterValueOf(input.text).locked) return [];
    return typeOf(output) === typeOf(input) ? [name] : [];
  });
}
