/** Computes which outputs reach which inputs, by every arrow that hands something over. Pure. */
import { flatName, relationId } from "../document-keys";
import {
  type Action,
  ENTRY,
  type Graph,
  type Key,
  type Parameter,
  PRECONDITIONS,
  type Relation,
} from "../model";
import { handedOver } from "./handed-over";
import { type ParameterValue, parameterValueOf } from "./values";

/** An output that an arrow brings to an input. */
export interface InputGiver {
  readonly relation: string;
  readonly parent: Key;
  readonly parentName: string;
  /** The flat name of the output. */
  readonly output: string;
  /** True if the arrow renames it. */
  readonly renamed: boolean;
  /** The reason why the engine does not take it; null when it does. */
  readonly misfit: string | null;
}

/** The givers of each input, by the input's path; inputs without a giver are left out. */
export type InputGivers = ReadonlyMap<string, readonly InputGiver[]>;
/** The givers of inputs, by action, for every action that has any. */
export type DataFlow = ReadonlyMap<Key, InputGivers>;

const values = new WeakMap<Parameter, ParameterValue>();

/** Its value, read once: parameters keep their identity while they do not change. */
export function readValue(parameter: Parameter): ParameterValue {
  const known = values.get(parameter) ?? parameterValueOf(parameter.text);
  values.set(parameter, known);
  return known;
}

/** Returns true if the engine hands outputs over along an arrow: unless the arrow ignores or bypasses every end. */
export function handsOver({ conditions, only, listing, parent }: Relation): boolean {
  if (only !== null || listing > 0 || parent === ENTRY) return false;
  return PRECONDITIONS.some((end) => conditions[end] !== "ignore" && conditions[end] !== "bypass");
}

/** Returns why an input does not take an output of its name; null when it does. */
export function misfitOf(from: ParameterValue, to: ParameterValue): string | null {
  if (from.type !== to.type) return `takes ${to.type ?? "no type"}, not ${from.type ?? "no type"}`;
  return to.locked ? "is locked" : null;
}

interface Read {
  readonly parts: readonly object[];
  readonly givers: InputGivers;
}

const read = new WeakMap<Action, Read>();
const NOTHING: InputGivers = new Map();

/** Returns the outputs that reach the inputs of one action: the same object while none of them changes. */
function giversOf(
  action: Action,
  arrows: readonly Relation[],
  actions: ReadonlyMap<Key, Action>,
): InputGivers {
  const pairs = arrows.flatMap((relation) => {
    const parent = actions.get(relation.parent);
    return parent && !parent.missing && parent.outputs.length > 0 ? [{ relation, parent }] : [];
  });
  if (pairs.length === 0) return NOTHING;
  const parts = pairs.flatMap(({ relation, parent }) => [relation, parent]);
  const known = read.get(action);
  if (known?.parts.length === parts.length && parts.every((part, i) => part === known.parts[i])) {
    return known.givers;
  }
  const found = new Map<string, InputGiver[]>();
  const inputs = new Map(action.inputs.map((input) => [flatName(input.path), input]));
  for (const { relation, parent } of pairs) {
    const outputs = new Map(parent.outputs.map((output) => [flatName(output.path), output]));
    const reached = handedOver([...outputs.keys()], relation.remap, [...inputs.keys()]);
    for (const [name, output] of reached ?? []) {
      const [from, to] = [outputs.get(output), inputs.get(name)];
      if (!from || !to) continue;
      const giver: InputGiver = {
        relation: relationId(relation),
        parent: parent.key,
        parentName: parent.name,
        output,
        renamed: output !== name,
        misfit: misfitOf(readValue(from), readValue(to)),
      };
      const others = found.get(to.path);
      if (others) others.push(giver);
      else found.set(to.path, [giver]);
    }
  }
  const givers = found.size === 0 ? NOTHING : found;
  read.set(action, { parts, givers });
  return givers;
}

const flows = new WeakMap<Graph["actions"], { relations: Graph["relations"]; flow: DataFlow }>();

/** Returns the data flow of a graph; computed once for each state of it. */
export function dataFlowOf({ actions, relations }: Pick<Graph, "actions" | "relations">): DataFlow {
  const known = flows.get(actions);
  if (known?.relations === relations) return known.flow;
  const flow = flowOf(actions, relations);
  flows.set(actions, { relations, flow });
  return flow;
}

function flowOf(actions: Graph["actions"], relations: Graph["relations"]): DataFlow {
  const byKey = new Map(actions.map((action) => [action.key, action]));
  const arriving = new Map<Key, Relation[]>();
  for (const relation of relations) {
    if (!handsOver(relation)) continue;
    const known = arriving.get(relation.child);
    if (known) known.push(relation);
    else arriving.set(relation.child, [relation]);
  }
  const flow = new Map<Key, InputGivers>();
  for (const action of actions) {
    const arrows = action.inputs.length > 0 ? arriving.get(action.key) : undefined;
    const givers = arrows ? giversOf(action, arrows, byKey) : NOTHING;
    if (givers.size > 0) flow.set(action.key, givers);
  }
  return flow;
}

/** Returns the givers of an input whose output the engine takes. */
export function takenGivers(givers: readonly InputGiver[] | undefined): readonly InputGiver[] {
  return givers?.filter(({ misfit }) => misfit === null) ?? [];
}

/** The actions that give an input, or that take an output, of one action. */
export interface Touched {
  readonly producers: readonly Key[];
  readonly consumers: readonly Key[];
}

/**
 * Returns the actions that a parameter ties together: those that give it and those that take it. `path`: its path
 * on its side.
 */
export function touchedBy(flow: DataFlow, key: Key, side: "in" | "out", path: string): Touched {
  if (side === "in") {
    const producers = takenGivers(flow.get(key)?.get(path)).map(({ parent }) => parent);
    return { producers: [...new Set(producers)], consumers: [key] };
  }
  const name = flatName(path);
  const consumers = [...flow].filter(([, givers]) =>
    [...givers.values()].some((list) =>
      list.some((each) => each.parent === key && each.output === name && each.misfit === null),
    ),
  );
  return { producers: [key], consumers: consumers.map(([consumer]) => consumer) };
}
