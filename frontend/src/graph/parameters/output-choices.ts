/** The outputs that an input can take its value from, and for every other one why not. Pure. */
import { flatName, relationId } from "../document-keys";
import {
  type Action,
  ENTRY,
  type Graph,
  type Key,
  type Parameter,
  type Relation,
  type Remap,
} from "../model";
import { endName } from "../relation-words";
import { handsOver, misfitOf, readValue } from "./data-flow";
import { handedOver } from "./handed-over";

/** One output as a choice; `reason` says why it cannot be taken. */
export interface OutputChoice {
  readonly parent: Key;
  readonly parentName: string;
  /** Flat name of the output, or of the group of outputs. */
  readonly output: string;
  /** The outputs and the inputs that they become. */
  readonly ties: readonly Tie[];
  readonly type: string | null;
  /** The arrow that brings the output; null where none leads here. */
  readonly relation: string | null;
  readonly reason: string | null;
  /** True if the input gets it now. */
  readonly taken: boolean;
}

/** An output and the input that is to get it, by their flat names. */
export interface Tie {
  readonly output: string;
  readonly input: string;
}

/** Returns the renamings of an arrow with which each output arrives as its input. */
export function remapFor(remap: readonly Remap[], ties: readonly Tie[]): Remap[] {
  const outputs = new Set(ties.map(({ output }) => output));
  const inputs = new Set(ties.map(({ input }) => input));
  const others = remap.filter(({ source, target }) => !outputs.has(source) && !inputs.has(target));
  const renamed = ties.filter(({ output, input }) => output !== input);
  return [...others, ...renamed.map(({ output, input }) => ({ source: output, target: input }))];
}

/** The actions from which arrows lead to one, however far. */
function before(relations: readonly Relation[], key: Key): ReadonlySet<Key> {
  const parents = new Map<Key, Key[]>();
  for (const { parent, child } of relations) {
    parents.set(child, [...(parents.get(child) ?? []), parent]);
  }
  const found = new Set<Key>();
  const open = [key];
  for (let now = open.pop(); now !== undefined; now = open.pop()) {
    for (const parent of parents.get(now) ?? []) {
      if (parent === ENTRY || found.has(parent)) continue;
      found.add(parent);
      open.push(parent);
    }
  }
  return found;
}

interface Arrivals {
  readonly action: Action;
  readonly direct: ReadonlyMap<Key, Relation>;
  readonly earlier: ReadonlySet<Key>;
}

function waysTo({ relations }: Pick<Graph, "relations">, action: Action): Arrivals {
  const arriving = relations.filter(
    (relation) => relation.child === action.key && handsOver(relation),
  );
  const direct = new Map(arriving.map((relation) => [relation.parent, relation]));
  return { action, direct, earlier: before(relations, action.key) };
}

const flatNames = (list: readonly Parameter[]): string[] => list.map(({ path }) => flatName(path));

/** Returns what a renaming would break of what the arrow brings already; null when it breaks nothing. */
function harm({ action }: Arrivals, parent: Action, relation: Relation, ties: readonly Tie[]) {
  const [outputs, inputs] = [flatNames(parent.outputs), flatNames(action.inputs)];
  for (const { output, input } of ties) {
    const known = relation.remap.find(({ source }) => source === output);
    if (known && known.target !== input) return `reaches it as ${known.target} already`;
  }
  const next = handedOver(outputs, remapFor(relation.remap, ties), inputs);
  if (ties.some(({ output, input }) => next?.get(input) !== output)) {
    return "the engine would not find it under this name";
  }
  const tied = new Set(ties.flatMap(({ output, input }) => [`> ${input}`, output]));
  const now = handedOver(outputs, relation.remap, inputs) ?? new Map<string, string>();
  const lost = [...now].filter(
    ([to, from]) => !tied.has(`> ${to}`) && !tied.has(from) && !next?.has(to),
  );
  return lost.length === 0 ? null : `the engine would lose ${lost.map(([to]) => to).join(", ")}`;
}

/** Returns why these outputs of an action cannot be taken; null when they can. */
function reasonOf(ways: Arrivals, parent: Action, ties: readonly Tie[]): string | null {
  if (parent.missing) return "is not there";
  const find = (list: readonly Parameter[], name: string) =>
    list.find(({ path }) => flatName(path) === name);
  for (const { output, input } of ties) {
    const [from, to] = [find(parent.outputs, output), find(ways.action.inputs, input)];
    const misfit = from && to ? misfitOf(readValue(from), readValue(to)) : null;
    if (misfit !== null) return misfit;
  }
  const relation = ways.direct.get(parent.key);
  if (relation) return harm(ways, parent, relation, ties);
  if (parent.key === ways.action.key) return "is its own output";
  return ways.earlier.has(parent.key)
    ? "no arrow leads from there to here"
    : "does not come before";
}

function rankOf({ reason, relation, taken }: OutputChoice): number {
  if (reason === null) return taken ? 0 : 1;
  return relation === null ? 3 : 2;
}

/** The outputs that an input, or a group of inputs, gets now. */
type Given = readonly { readonly parent: Key; readonly output: string }[];

function choiceOf(
  graph: Graph,
  ways: Arrivals,
  parent: Action,
  given: Given,
  what: Pick<OutputChoice, "output" | "type" | "ties">,
): OutputChoice {
  const relation = ways.direct.get(parent.key);
  const taken = what.ties.every(({ output }) =>
    given.some((each) => each.parent === parent.key && each.output === output),
  );
  return {
    ...what,
    parent: parent.key,
    parentName: endName(graph, parent.key),
    relation: relation ? relationId(relation) : null,
    reason: taken ? null : reasonOf(ways, parent, what.ties),
    taken,
  };
}

/** Returns every output of the graph as a choice for one input, the possible ones first. */
export function outputChoices(
  graph: Graph,
  action: Action,
  path: string,
  given: Given,
): OutputChoice[] {
  const ways = waysTo(graph, action);
  const input = flatName(path);
  const choices = graph.actions.flatMap((parent) =>
    parent.outputs.map((each) => {
      const output = flatName(each.path);
      const ties = [{ output, input }];
      return choiceOf(graph, ways, parent, given, { output, type: readValue(each).type, ties });
    }),
  );
  return choices.sort((a, b) => rankOf(a) - rankOf(b));
}

/** Returns the groups of outputs that have all members of a group of inputs, such as poses for a pose. */
export function groupChoices(
  graph: Graph,
  action: Action,
  prefix: string,
  word: string,
  given: Given,
): OutputChoice[] {
  const ways = waysTo(graph, action);
  const members = action.inputs.flatMap(({ path }) =>
    path.startsWith(prefix) ? [path.slice(prefix.length)] : [],
  );
  const [first = ""] = members;
  const choices = graph.actions.flatMap((parent) => {
    const paths = new Set(parent.outputs.map(({ path }) => path));
    const heads = [...paths].flatMap((path) =>
      path.endsWith(`/${first}`) ? [path.slice(0, -first.length)] : [],
    );
    return heads
      .filter((head) => members.every((member) => paths.has(head + member)))
      .map((head) => {
        const ties = members.map((member) => ({
          output: flatName(head + member),
          input: flatName(prefix + member),
        }));
        const output = flatName(head.slice(0, -1));
        return choiceOf(graph, ways, parent, given, { output, type: word, ties });
      });
  });
  return choices.sort((a, b) => rankOf(a) - rankOf(b));
}
