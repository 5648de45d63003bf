import fc from "fast-check";
import { expect, test } from "vitest";
import {
  type Action,
  EMPTY_GRAPH,
  ENTRY,
  type Graph,
  IGNORE_ALL,
  PRECONDITIONS,
  RESPONSES,
  type Relation,
} from "../../graph/model";
import { sceneOf } from "../elements";
import { fromUmrf } from "../from-umrf";
import type { Positions } from "../geometry/ranks";
import { NO_PROBLEM_MARKS } from "../marks/problem-marks";
import { bundlesOf, pillSizeOf, pillWord } from "./bundles";

const relation = (more: Partial<Relation>): Relation => ({
  ...{ parent: "a", child: "b", listing: 0, conditions: IGNORE_ALL, required: true },
  ...{
    remap: [],
    only: null,
    parentOrder: 0,
    childOrder: 0,
    parentsExtra: [],
    childrenExtra: [],
    waypoints: [],
  },
  ...more,
});

const conditions = fc.record({
  on_true: fc.constantFrom(...RESPONSES),
  on_false: fc.constantFrom(...RESPONSES),
  on_error: fc.constantFrom(...RESPONSES),
  on_stopped: fc.constantFrom(...RESPONSES),
});

test("outcomes with the same response share one line", () => {
  fc.assert(
    fc.property(conditions, fc.boolean(), (conditions, required) => {
      const bundles = bundlesOf(relation({ conditions, required }));
      const answered = PRECONDITIONS.filter((outcome) => conditions[outcome] !== "ignore");
      const drawn = bundles.flatMap(({ outcomes }) => outcomes);
      expect([...drawn].sort()).toEqual([...answered].sort());
      expect(bundles.length).toBe(Math.max(1, new Set(answered.map((o) => conditions[o])).size));
      expect(new Set(bundles.map(({ id }) => id)).size).toBe(bundles.length);
      for (const { outcomes, response, optional } of bundles) {
        expect(optional).toBe(!required);
        expect(outcomes.every((outcome) => conditions[outcome] === response)).toBe(true);
        expect([...outcomes]).toEqual(PRECONDITIONS.filter((each) => outcomes.includes(each)));
      }
    }),
  );
});

test("the response run has no word on its pill, and ignored outcomes are not drawn", () => {
  const said = { ...IGNORE_ALL, on_true: "run", on_error: "run", on_false: "stop" } as const;
  const bundles = bundlesOf(relation({ conditions: said }));
  expect(bundles.map((bundle) => [bundle.outcomes.join(), pillWord(bundle)])).toEqual([
    ["on_true,on_error", ""],
    ["on_false", "stop"],
  ]);
});

test("a relation that ignores all outcomes has a line with the words ignores all", () => {
  const [only, ...others] = bundlesOf(relation({}));
  expect([only && pillWord(only), only?.outcomes, others]).toEqual(["ignores all", [], []]);
});

test("a line keeps its id while outcomes are added and removed", () => {
  const some = bundlesOf(relation({ conditions: { ...IGNORE_ALL, on_error: "run" } }));
  const more = bundlesOf(
    relation({ conditions: { ...IGNORE_ALL, on_true: "run", on_error: "run" } }),
  );
  expect(some.map(({ id }) => id)).toEqual(more.map(({ id }) => id));
});

test("the entry has a pill only for problems, and a pill grows with its contents", () => {
  const [entry] = bundlesOf(
    relation({ parent: ENTRY, conditions: { ...IGNORE_ALL, on_true: "run" } }),
  );
  expect(entry && pillSizeOf(entry, false)).toBeNull();
  expect(entry && pillSizeOf(entry, true)).not.toBeNull();
  const wide = (conditions: Relation["conditions"]) => {
    const [bundle] = bundlesOf(relation({ conditions }));
    return (bundle && pillSizeOf(bundle, false)?.width) ?? 0;
  };
  const one = wide({ ...IGNORE_ALL, on_true: "run" });
  expect(wide({ ...IGNORE_ALL, on_true: "run", on_false: "run" })).toBeGreaterThan(one);
  expect(wide({ ...IGNORE_ALL, on_true: "restart" })).toBeGreaterThan(one);
});

test("waypoints belong to one response of a relation, also in a published file", () => {
  const conditions = { ...IGNORE_ALL, on_true: "run", on_error: "stop" } as const;
  const [run, stop] = bundlesOf(relation({ conditions, waypoints: [["stop", "[[1,2]]"]] }));
  expect([run?.waypoints, stop?.waypoints]).toEqual([[], [[1, 2]]]);
  const action = (name: string) => ({ name, instance_id: 0, type: "sync" });
  const points = [[60, -24]];
  const bend = { parent: "A_0", child: "B_0", response: "run", points };
  const graph = fromUmrf({
    actions: [action("A"), { ...action("B"), parents: [action("A")] }],
    gui_attributes: { action_assistant: { waypoints: [bend, 7, { ...bend, child: "C_0" }] } },
  });
  const bundles = graph.relations.flatMap(bundlesOf);
  expect(bundles.map(({ waypoints }) => waypoints)).toEqual([points, []]);
});

test("waypoints move along while both ends of a line are dragged", () => {
  const graph: Graph = {
    ...{ ...EMPTY_GRAPH, actions: ["a", "b"].map(actionOf) },
    relations: [
      relation({ conditions: { ...IGNORE_ALL, on_true: "run" }, waypoints: [["run", "[[9,9]]"]] }),
    ],
  };
  const rest: Positions = new Map([
    ["a", [0, 0]],
    ["b", [400, 0]],
  ]);
  const via = (places: Positions) =>
    sceneOf(graph, { places, rest, measured: new Map(), marks: NO_PROBLEM_MARKS }, null).lines[0]
      ?.waypoints;
  const dragged: Positions = new Map([...rest, ["a", [5, 7]]]);
  expect(via(dragged)).toEqual([[9, 9]]);
  expect(via(new Map([...dragged, ["b", [405, 7]]]))).toEqual([[14, 16]]);
});

const actionOf = (key: string): Action => ({
  ...{ key, name: key, instanceId: 0, type: "sync", actor: "", description: "", inputs: [] },
  ...{ outputs: [], position: null, missing: false, twin: false, extra: [] },
});
