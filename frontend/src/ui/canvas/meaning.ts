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

type Said = readonly [name: string, ...rest: unknown[]];

/** What each action and each arrow says, by the names that the engine knows. */
function said(graph: Graph): { actions: Said[]; arrows: Said[] } {
  const names = new Map<Key, string>(graph.actions.map((action) => [action.key, fullName(action)]));
  names.set(ENTRY, ">").set(EXIT, "<");
  const actions = graph.actions
    .filter((action) => !action.missing)
    .map(
      (action): Said => [
        fullName(action),
        action.type,
        action.actor,
        action.description,
        parameters(action.inputs),
        parameters(action.outputs),
      ],
    );
  const arrows = graph.relations
    .filter(({ parent, child }) => names.has(parent) && names.has(child))
    .map(
      (relation): Said => [
        names.get(relation.parent) ?? "",
        names.get(relation.child),
        relation.parent === ENTRY
          ? []
          : PRECONDITIONS.map((outcome) => relation.conditions[outcome]),
        relation.required || relation.parent === ENTRY,
        relation.remap.map(({ source, target }) => `${source}>${target}`).sort(),
      ],
    );
  return { actions, arrows };
}

export function meaning(graph: Graph): string {
  const { actions, arrows } = said(graph);
  const sorted = (list: readonly Said[]) => list.map((item) => JSON.stringify(item)).sort();
  return JSON.stringify([graph.name, graph.description, sorted(actions), sorted(arrows)]);
}

export interface Difference {
  readonly kind: "added" | "removed" | "changed";
  readonly what: string;
}

/** What another graph does otherwise, thing by thing; how it is drawn is no difference. */
export function differences(before: Graph, after: Graph): Difference[] {
  const [old, now] = [said(before), said(after)];
  const ends = (name: string) => (name === ">" ? "Start" : name === "<" ? "End" : name);
  const head =
    before.name !== after.name || before.description !== after.description
      ? [{ kind: "changed", what: "Name or description of the graph" } as const]
      : [];
  return [
    ...head,
    ...compared(old.actions, now.actions, ([name]) => `Action ${name}`),
    ...compared(old.arrows, now.arrows, ([parent, child]) => {
      return `Arrow ${ends(parent)} → ${ends(String(child))}`;
    }),
  ];
}

function compared(
  before: readonly Said[],
  after: readonly Said[],
  named: (said: Said) => string,
): Difference[] {
  const texts = (list: readonly Said[]) =>
    new Map(list.map((item) => [named(item), JSON.stringify(item)]));
  const [old, now] = [texts(before), texts(after)];
  const found: Difference[] = [];
  for (const [what, text] of now) {
    const was = old.get(what);
    if (was === undefined) found.push({ kind: "added", what });
    else if (was !== text) found.push({ kind: "changed", what });
  }
  for (const what of old.keys()) if (!now.has(what)) found.push({ kind: "removed", what });
  return found;
}
