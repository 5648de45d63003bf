/**
 * Inputs for which a start asks: those that the graph leaves open, and those that its author marks. The twin of
 * `asked_inputs` in `umrf/start_values.py`. Pure.
 */
import { flatName } from "../document-keys";
import { type Action, ENTRY, type Graph, type JsonText, type Key, type Relation } from "../model";
import { readValue } from "./data-flow";
import { handedOver } from "./handed-over";

/** Bounds that an author sets for an input that is asked for. */
export interface Bounds {
  readonly least?: number;
  readonly most?: number;
}

const NO_BOUNDS: Bounds = {};

/** Return the bounds in the mark of an input; null if its author has not marked it. */
export function askOf(action: Pick<Action, "asks">, path: string): Bounds | null {
  const mark = action.asks?.find(([marked]) => marked === path)?.[1];
  return mark === undefined ? null : boundsIn(mark);
}

function boundsIn(mark: JsonText): Bounds {
  let found: unknown;
  try {
    found = JSON.parse(mark);
  } catch {
    return NO_BOUNDS;
  }
  if (typeof found !== "object" || found === null || Array.isArray(found)) return NO_BOUNDS;
  const { least, most } = found as Record<string, unknown>;
  const wrong = [least, most].some((each) => each !== undefined && typeof each !== "number");
  if (wrong) return NO_BOUNDS;
  return {
    ...(least !== undefined && { least: least as number }),
    ...(most !== undefined && { most: most as number }),
  };
}

/** The inputs for which a start asks, by action and path. */
export type AskedPaths = ReadonlyMap<Key, ReadonlySet<string>>;

const asked = new WeakMap<Graph["actions"], { relations: Graph["relations"]; paths: AskedPaths }>();

/** Return the inputs for which a start of the graph asks; computed once for each state of it. */
export function askedPaths({
  actions,
  relations,
}: Pick<Graph, "actions" | "relations">): AskedPaths {
  const known = asked.get(actions);
  if (known?.relations === relations) return known.paths;
  const paths = pathsOfAll(actions, relations);
  asked.set(actions, { relations, paths });
  return paths;
}

function pathsOfAll(actions: Graph["actions"], relations: Graph["relations"]): AskedPaths {
  const found = new Map<Key, ReadonlySet<string>>();
  const asking = actions.filter((each) => !each.missing && !each.twin && mayAsk(each));
  if (asking.length === 0) return found;
  const byKey = new Map(actions.map((each) => [each.key, each]));
  const into = new Map<Key, Relation[]>();
  for (const relation of relations) {
    const known = into.get(relation.child);
    if (known) known.push(relation);
    else into.set(relation.child, [relation]);
  }
  for (const action of asking) {
    const paths = pathsOf(action, into.get(action.key) ?? [], byKey);
    if (paths.size > 0) found.set(action.key, paths);
  }
  return found;
}

const isLeftOpen = (parameter: Action["inputs"][number]): boolean => {
  const { required, value } = readValue(parameter);
  return required && value === null;
};

const mayAsk = (action: Action): boolean =>
  action.asks !== undefined || action.inputs.some(isLeftOpen);

function pathsOf(
  action: Action,
  incoming: readonly Relation[],
  byKey: ReadonlyMap<Key, Action>,
): ReadonlySet<string> {
  const isEntry = incoming.some(({ parent }) => parent === ENTRY);
  const brought = incoming
    .filter(({ parent }) => parent !== ENTRY)
    .map((relation) => broughtBy(relation, byKey.get(relation.parent), action));
  const paths = new Set<string>();
  const seen = new Set<string>();
  for (const input of action.inputs) {
    const name = flatName(input.path);
    if (readValue(input).native === null || seen.has(name)) continue;
    seen.add(name);
    const comes = brought.some((each) => each.has(name));
    const always = brought.length > 0 && !isEntry && brought.every((each) => each.has(name));
    const open = incoming.length > 0 && isLeftOpen(input) && (isEntry || !comes);
    if (open || (askOf(action, input.path) !== null && !always)) paths.add(input.path);
  }
  return paths;
}

/** Return the flat names of the inputs that get a value by an arrow. */
function broughtBy(
  { remap }: Relation,
  parent: Action | undefined,
  child: Action,
): ReadonlySet<string> {
  if (parent === undefined) return new Set();
  const types = (list: Action["inputs"]) =>
    new Map(list.map((each) => [flatName(each.path), readValue(each)]));
  const outputs = types(parent.outputs);
  const inputs = new Map([...types(child.inputs)].filter(([, { locked }]) => !locked));
  const places = handedOver([...outputs.keys()], remap, [...inputs.keys()]) ?? new Map();
  const fitting = [...places].filter(
    ([name, output]) => outputs.get(output)?.type === inputs.get(name)?.type,
  );
  return new Set(fitting.map(([name]) => name));
}
