/**
 * A graph from a file beside a document: files spell values and order lists their own way, and may come
 * from elsewhere. What says the same becomes the same. Pure.
 */
import { relationId } from "../../graph/document-keys";
import {
  type Action,
  fullName,
  type Graph,
  type Key,
  type Parameter,
  PRECONDITIONS,
  type Relation,
} from "../../graph/model";
import { isEqual } from "../../graph/values";

function parsed(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}

const saysSame = (a: string, b: string): boolean => a === b || isEqual(parsed(a), parsed(b));

function parameters(mine: readonly Parameter[], theirs: readonly Parameter[]): Parameter[] {
  const known = new Map(theirs.map((each) => [each.path, each]));
  return mine.map((each) => {
    const other = known.get(each.path);
    return other !== undefined && saysSame(each.text, other.text) ? other : each;
  });
}

/** What stands in a file and a document in different places is not compared. */
function action(mine: Action, other: Action): Action {
  const { missing, twin, extra } = other;
  const inputs = parameters(mine.inputs, other.inputs);
  const outputs = parameters(mine.outputs, other.outputs);
  const same = (a: readonly Parameter[], b: readonly Parameter[]) =>
    a.length === b.length && a.every((each) => b.includes(each));
  return {
    ...mine,
    ...{ key: other.key, missing, twin, extra },
    inputs: same(inputs, other.inputs) ? other.inputs : inputs,
    outputs: same(outputs, other.outputs) ? other.outputs : outputs,
    position: mine.position ?? other.position,
  };
}

function relation(mine: Relation, other: Relation): Relation {
  const same =
    mine.required === other.required &&
    PRECONDITIONS.every((on) => mine.conditions[on] === other.conditions[on]) &&
    mine.remap.length === other.remap.length &&
    mine.remap.every(({ source, target }) =>
      other.remap.some((each) => each.source === source && each.target === target),
    );
  return same ? other : { ...mine, waypoints: other.waypoints };
}

/** `graph`, as far as it says the same as `other` with what is in that. */
export function alignedWith(graph: Graph, other: Graph): Graph {
  const keys = new Set(other.actions.map(({ key }) => key));
  const byName = new Map(other.actions.map((each) => [fullName(each), each]));
  const found = new Map<Key, Action>();
  for (const each of graph.actions) {
    const same = keys.has(each.key)
      ? other.actions.find(({ key }) => key === each.key)
      : byName.get(fullName(each));
    if (same !== undefined) found.set(each.key, same);
  }
  const keyOf = (key: Key): Key => found.get(key)?.key ?? key;
  const arrows = new Map(other.relations.map((each) => [relationId(each), each]));
  const { name, description, direction, extra } = other;
  return {
    ...graph,
    // The name of a sent graph may be its robot's; how it is drawn is nobody's but the editor's.
    ...{ name, direction, extra, description: graph.description || description },
    notes: other.notes,
    actions: graph.actions.map((each) => {
      const same = found.get(each.key);
      return same === undefined ? each : action(each, same);
    }),
    relations: graph.relations.map((each) => {
      const moved = { ...each, parent: keyOf(each.parent), child: keyOf(each.child) };
      const same = arrows.get(relationId(moved));
      return same === undefined ? moved : relation(moved, same);
    }),
  };
}
