/**
 * Reads canonical UMRF, such as a published version, as a graph to draw. It never fails: members
 * that do not fit are left out.
 */
import { parametersFrom } from "../graph/edit";
import {
  type Action,
  ENGINE_DEFAULTS,
  ENTRY,
  ENTRY_CONDITIONS,
  EXIT,
  fullName,
  type Graph,
  type Key,
  type Position,
  PRECONDITIONS,
  type Precondition,
  RESPONSES,
  type Relation,
  type Remap,
  type Response,
} from "../graph/model";
import { asDirection } from "../graph/values";

type JsonObject = Record<string, unknown>;

const object = (value: unknown): JsonObject =>
  typeof value === "object" && value !== null && !Array.isArray(value) ? (value as JsonObject) : {};
const list = (value: unknown): JsonObject[] => (Array.isArray(value) ? value.map(object) : []);
const text = (value: unknown): string => (typeof value === "string" ? value : "");
const whole = (value: unknown): number => (typeof value === "number" ? value : 0);

function position(value: unknown): Position | null {
  const { x, y } = object(value);
  return typeof x === "number" && typeof y === "number" ? [x, y] : null;
}

function action(fields: JsonObject): Action {
  const gui = object(fields.gui_attributes);
  const name = text(fields.name);
  const instanceId = whole(fields.instance_id);
  return {
    key: text(object(gui.action_assistant).aid) || `${name}_${instanceId}`,
    name,
    instanceId,
    type: text(fields.type) || "sync",
    actor: text(fields.actor),
    description: text(fields.description),
    inputs: parametersFrom(fields.input_parameters),
    outputs: parametersFrom(fields.output_parameters),
    position: position(gui.position),
    missing: false,
    twin: false,
    extra: [],
  };
}

function conditions(value: unknown) {
  const found: Record<Precondition, Response> = { ...ENGINE_DEFAULTS };
  for (const item of Array.isArray(value) ? value : []) {
    const [when, then] = text(item)
      .split("->")
      .map((part) => part.trim());
    if (PRECONDITIONS.includes(when as Precondition) && RESPONSES.includes(then as Response)) {
      found[when as Precondition] = then as Response;
    }
  }
  return found;
}

const plain = {
  required: true,
  remap: [],
  only: null,
  parentOrder: 0,
  childOrder: 0,
  parentsExtra: [],
  childrenExtra: [],
  waypoints: [],
} as const;

function remaps(value: unknown): Remap[] {
  return list(value).map((item) => ({ source: text(item.from), target: text(item.to) }));
}

/**
 * Return the relations with the waypoints of a file, which name actions by full names
 * (docs/decisions/052-waypoints.md).
 */
function bent(relations: readonly Relation[], actions: readonly Action[], told: unknown) {
  const names = new Map(actions.map((each) => [each.key, fullName(each)]));
  const nameOf = (key: Key) => names.get(key) ?? key;
  const texts = new Map(
    list(told).map(({ parent, child, listing, response, points }) => [
      `${text(parent)} ${text(child)} ${whole(listing)} ${text(response)}`,
      JSON.stringify(points ?? null),
    ]),
  );
  return relations.map((relation) => {
    const ends = `${nameOf(relation.parent)} ${nameOf(relation.child)} ${relation.listing}`;
    const waypoints = RESPONSES.flatMap((response) => {
      const said = texts.get(`${ends} ${response}`);
      return said === undefined ? [] : [[response, said] as const];
    });
    return waypoints.length === 0 ? relation : { ...relation, waypoints };
  });
}

/** Return the graph of a UMRF object: its actions, relations, places, notes and waypoints. */
export function fromUmrf(umrf: unknown): Graph {
  const root = object(umrf);
  const raw = list(root.actions);
  const actions = raw.map(action);
  const byName = new Map<string, Key>(actions.map((a) => [`${a.name}_${a.instanceId}`, a.key]));
  const keyOf = (fields: JsonObject) =>
    byName.get(`${text(fields.name)}_${whole(fields.instance_id)}`);
  const relations = new Map<string, Relation>();
  const put = (relation: Omit<Relation, "listing">) => {
    let listing = 0;
    const id = () => `${relation.parent}>${relation.child};${listing}`;
    while (relations.has(id())) listing += 1;
    relations.set(id(), { ...relation, listing });
  };
  for (const entry of list(root.graph_entry)) {
    const child = keyOf(entry);
    if (child) put({ ...plain, parent: ENTRY, child, conditions: ENTRY_CONDITIONS });
  }
  const takeParents = (child: Key, parents: unknown) => {
    for (const fields of list(parents)) {
      const parent = keyOf(fields);
      if (!parent) continue;
      const required = fields.required !== false;
      put({ ...plain, parent, child, required, conditions: conditions(fields.conditions) });
    }
  };
  raw.forEach((fields, i) => {
    const child = actions[i]?.key;
    if (child) takeParents(child, fields.parents);
  });
  raw.forEach((fields, i) => {
    const parent = actions[i]?.key;
    for (const child of list(fields.children)) {
      const id = `${parent}>${keyOf(child)};0`;
      const known = relations.get(id);
      if (known) relations.set(id, { ...known, remap: remaps(child.remap) });
    }
  });
  takeParents(EXIT, root.graph_exit);
  const gui = object(object(root.gui_attributes).action_assistant);
  return {
    name: text(root.graph_name),
    description: text(root.graph_description),
    actions,
    relations: bent([...relations.values()], actions, gui.waypoints),
    entryPosition: position(gui.entry) ?? position(object(gui.positions).entry),
    exitPosition: position(gui.exit) ?? position(object(gui.positions).exit),
    direction: asDirection(gui.direction),
    notes: Object.entries(object(gui.notes)).map(([id, note]) => [id, JSON.stringify(note)]),
    extra: [],
  };
}
