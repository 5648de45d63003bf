/**
 * Part of a graph as UMRF text, for the clipboard: actions and the arrows among them.
 *
 * Values keep their spelling, since they are JSON text all along. The server writes whole files.
 */

import { segmentsOf } from "./document-keys";
import {
  type Action,
  type Extra,
  type Graph,
  type JsonText,
  type Key,
  type Parameter,
  type Position,
  PRECONDITIONS,
  type Relation,
} from "./model";

/** A tree of values to be written; a text is JSON already. */
type Tree = JsonText | readonly Tree[] | ReadonlyMap<string, Tree>;

const text = (value: unknown): JsonText => JSON.stringify(value);
const fields = (...members: readonly (readonly [string, Tree] | null)[]): Map<string, Tree> =>
  new Map(members.filter((member) => member !== null));

function written(tree: Tree, indent: string): string {
  if (typeof tree === "string") return tree;
  const inner = `${indent}  `;
  if (isList(tree)) {
    if (tree.length === 0) return "[]";
    return `[\n${tree.map((item) => inner + written(item, inner)).join(",\n")}\n${indent}]`;
  }
  if (tree.size === 0) return "{}";
  const members = [...tree].map(
    ([name, value]) => `${inner}${text(name)}: ${written(value, inner)}`,
  );
  return `{\n${members.join(",\n")}\n${indent}}`;
}

const isList = (tree: Tree): tree is readonly Tree[] => Array.isArray(tree);

/** Returns the chosen actions as the text of a UMRF graph without entry and exit. */
export function umrfText(
  graph: Graph,
  chosen: ReadonlySet<Key>,
  places: ReadonlyMap<Key, Position>,
): string {
  const actions = new Map(
    graph.actions
      .filter((action) => chosen.has(action.key) && !action.missing)
      .map((action) => [action.key, action]),
  );
  const inner = graph.relations.filter(
    ({ parent, child }) => actions.has(parent) && actions.has(child),
  );
  const list = [...actions.values()].map((action) => actionOf(action, actions, inner, places));
  const tree = fields(
    ["graph_name", text(graph.name)],
    ["graph_entry", []],
    ["graph_exit", []],
    ["actions", list],
  );
  return `${written(tree, "")}\n`;
}

function actionOf(
  action: Action,
  actions: ReadonlyMap<Key, Action>,
  inner: readonly Relation[],
  places: ReadonlyMap<Key, Position>,
): Tree {
  const named = (key: Key): [string, Tree][] => {
    const other = actions.get(key);
    return [
      ["name", text(other?.name ?? "")],
      ["instance_id", text(other?.instanceId ?? 0)],
    ];
  };
  const parents = inner
    .filter((relation) => relation.child === action.key && relation.only !== "children")
    .sort((a, b) => a.childOrder - b.childOrder)
    .map((relation) =>
      fields(
        ...named(relation.parent),
        ["required", text(relation.required)],
        [
          "conditions",
          PRECONDITIONS.map((outcome) => text(`${outcome} -> ${relation.conditions[outcome]}`)),
        ],
        ...relation.parentsExtra,
      ),
    );
  const children = inner
    .filter((relation) => relation.parent === action.key && relation.only !== "parents")
    .sort((a, b) => a.parentOrder - b.parentOrder)
    .map((relation) =>
      fields(
        ...named(relation.child),
        relation.remap.length === 0
          ? null
          : [
              "remap",
              relation.remap.map((r) => fields(["from", text(r.source)], ["to", text(r.target)])),
            ],
        ...relation.childrenExtra,
      ),
    );
  return fields(
    ...named(action.key),
    ["type", text(action.type)],
    action.actor === "" ? null : ["actor", text(action.actor)],
    action.description === "" ? null : ["description", text(action.description)],
    action.inputs.length === 0 ? null : ["input_parameters", nested(action.inputs)],
    action.outputs.length === 0 ? null : ["output_parameters", nested(action.outputs)],
    parents.length === 0 ? null : ["parents", parents],
    children.length === 0 ? null : ["children", children],
    ...extraOf(action.extra),
    ["gui_attributes", placeOf(places.get(action.key))],
  );
}

const extraOf = (extra: Extra) => extra.filter(([field]) => field !== "gui_attributes");

function placeOf(at: Position | undefined): Tree {
  return at ? fields(["position", fields(["x", text(at[0])], ["y", text(at[1])])]) : fields();
}

function nested(parameters: readonly Parameter[]): Tree {
  const root = new Map<string, Tree>();
  for (const { path, text: value } of parameters) {
    const segments = segmentsOf(path);
    const name = segments.pop() ?? "";
    let at = root;
    for (const segment of segments) {
      const known = at.get(segment);
      const group = known instanceof Map ? (known as Map<string, Tree>) : new Map<string, Tree>();
      at.set(segment, group);
      at = group;
    }
    at.set(name, value);
  }
  return root;
}
