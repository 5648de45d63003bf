import { expect, test } from "vitest";
import { fromUmrf } from "../canvas/from-umrf";
import { differences } from "./meaning";
import type { Action, Graph, Relation } from "./model";

const named = (instance_id: number) => ({ name: "Drive", instance_id });
const graph: Graph = fromUmrf({
  graph_name: "patrol",
  graph_entry: [named(0)],
  graph_exit: [named(1)],
  actions: [
    {
      ...named(0),
      type: "sync",
      input_parameters: {
        speed: { pvf_type: "number", pvf_value: 0.5 },
        goal: { x: { pvf_type: "number" } },
      },
      children: [named(1)],
    },
    { ...named(1), type: "sync", parents: [{ ...named(0), required: true }] },
  ],
});

function withAction(change: (action: Action) => Action): Graph {
  const [first, ...others] = graph.actions;
  if (first === undefined) throw new Error("no action");
  return { ...graph, actions: [change(first), ...others] };
}

const input = (path: string, text: string) => (action: Action) => ({
  ...action,
  inputs: action.inputs.map((each) => (each.path === path ? { ...each, text } : each)),
});

test("a value that becomes another one is told with both", () => {
  const faster = withAction(input("speed", '{"pvf_type":"number","pvf_value":0.9}'));
  expect(differences(graph, faster)).toEqual([
    { kind: "changed", what: "Action Drive_0", details: ["speed: 0.5 → 0.9"] },
  ]);
});

test("a value that was not there, a longer one, and what is not a value", () => {
  const given = withAction(input("goal/x", '{"pvf_type":"number","pvf_value":3}'));
  expect(differences(graph, given)[0]?.details).toEqual(["goal.x: no value → 3"]);
  const long = `"${"a".repeat(200)}"`;
  const cut = withAction(input("speed", `{"pvf_type":"string","pvf_value":${long}}`));
  expect(differences(graph, cut)[0]?.details[0]?.length).toBeLessThan(90);
  const locked = input("speed", '{"pvf_type":"number","pvf_value":0.5,"pvf_updatable":false}');
  expect(differences(graph, withAction(locked))[0]?.details).toEqual(["speed: what is said of it"]);
  const other = withAction((action) => ({ ...action, actor: "Eve", inputs: [] }));
  expect(differences(graph, other)[0]?.details).toEqual([
    "robot: any → Eve",
    "speed is gone",
    "goal.x is gone",
  ]);
});

test("an arrow tells which of its responses become others", () => {
  const relations = graph.relations.map(
    (each): Relation =>
      each.parent === graph.actions[0]?.key
        ? { ...each, required: false, conditions: { ...each.conditions, on_false: "ignore" } }
        : each,
  );
  expect(differences(graph, { ...graph, relations })).toEqual([
    {
      kind: "changed",
      what: "Arrow Drive_0 → Drive_1",
      details: ["on false: run → ignore", "is waited for: yes → no"],
    },
  ]);
});

test("added and removed things are told as such, and another place is no difference", () => {
  const fewer = { ...graph, actions: graph.actions.slice(0, 1), relations: [] };
  expect(differences(graph, fewer).map(({ kind, what }) => `${kind} ${what}`)).toContain(
    "removed Action Drive_1",
  );
  expect(
    differences(
      graph,
      withAction((each) => ({ ...each, position: [9, 9] })),
    ),
  ).toEqual([]);
});
