/** What a graph says, apart from how it is drawn: equal texts for equal tasks. */
import {
  ENTRY,
  EXIT,
  fullName,
  type Graph,
  type Key,
  type Parameter,
  PRECONDITIONS,
} from "../../graph/model";

function value(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

/** Values with the members of objects in one order. */
function ordered(inner: unknown): unknown {
  if (Array.isArray(inner)) return inner.map(ordered);
  if (typeof inner !== "object" || inner === null) return inner;
  return Object.entries(inner)
    .map(([name, member]) => [name, ordered(member)])
    .sort(([a], [b]) => (String(a) < String(b) ? -1 : 1));
}

function parameters(list: readonly Parameter[]): unknown {
  return list.map(({ path, text }) => `${path} ${JSON.stringify(ordered(value(text)))}`).sort();
}

export function meaning(graph: Graph): string {
  const names = new Map<Key, string>(graph.actions.map((action) => [action.key, fullName(action)]));
  names.set(ENTRY, ">").set(EXIT, "<");
  const actions = graph.actions
    .filter((action) => !action.missing)
    .map((action) => [
      fullName(action),
      action.type,
      action.actor,
      action.description,
      parameters(action.inputs),
      parameters(action.outputs),
    ]);
  const relations = graph.relations
    .filter(({ parent, child }) => names.has(parent) && names.has(child))
    .map((relation) => [
      names.get(relation.parent),
      names.get(relation.child),
      relation.parent === ENTRY ? [] : PRECONDITIONS.map((outcome) => relation.conditions[outcome]),
      relation.required || relation.parent === ENTRY,
      relation.remap.map(({ source, target }) => `${source}>${target}`).sort(),
    ]);
  const sorted = (list: unknown[]) => list.map((item) => JSON.stringify(item)).sort();
  return JSON.stringify([graph.name, graph.description, sorted(actions), sorted(relations)]);
}
