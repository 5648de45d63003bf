/** Graphs of every shape, for properties: anything may follow anything, any number of outcomes. */
import fc from "fast-check";
import {
  type Action,
  type Direction,
  EMPTY_GRAPH,
  ENGINE_DEFAULTS,
  ENTRY,
  ENTRY_CONDITIONS,
  EXIT,
  type Graph,
  type Key,
  type Parameter,
  type Relation,
} from "../graph/model";

export const anyAction = (key: Key, inputs: readonly Parameter[] = []): Action => ({
  key,
  name: key,
  instanceId: 0,
  type: "sync",
  actor: "",
  description: "",
  inputs,
  outputs: [],
  position: null,
  missing: false,
  twin: false,
  extra: [],
});

export const anyRelation = (parent: Key, child: Key): Relation => ({
  parent,
  child,
  listing: 0,
  conditions: parent === ENTRY ? ENTRY_CONDITIONS : ENGINE_DEFAULTS,
  required: true,
  remap: [],
  only: null,
  parentOrder: 0,
  childOrder: 0,
  parentsExtra: [],
  childrenExtra: [],
  waypoints: [],
});

const parameters = fc.array(
  fc.constant<Parameter>({ path: "x", text: '{"pvf_type":"number","pvf_value":1}' }),
  { maxLength: 3 },
);

/** Up to 14 actions and 26 arrows that say what engines take for granted. */
export const graphs = fc
  .record({
    inputs: fc.array(parameters, { minLength: 1, maxLength: 14 }),
    pairs: fc.array(fc.tuple(fc.nat(14), fc.nat(15)), { maxLength: 26 }),
    direction: fc.constantFrom<Direction>("right", "down"),
  })
  .map(({ inputs, pairs, direction }): Graph => {
    const keys = inputs.map((_, i) => `a${i}`);
    const unique = new Map<string, Relation>();
    for (const [from, to] of pairs) {
      const parent = from === 14 ? ENTRY : keys[from % keys.length];
      const child = to === 15 && parent !== ENTRY ? EXIT : keys[to % keys.length];
      if (parent && child) unique.set(`${parent}>${child}`, anyRelation(parent, child));
    }
    const actions = keys.map((key, i) => anyAction(key, inputs[i]));
    return { ...EMPTY_GRAPH, direction, actions, relations: [...unique.values()] };
  });
