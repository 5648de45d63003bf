import { expect, test } from "vitest";
import { type ActionUse, NO_RENAMES } from "../api/library";
import {
  clashes,
  keyOfRename,
  possibleRenames,
  renamesOf,
  suggestedRenames,
} from "./rename-choices";

const use = (more: Partial<ActionUse>): ActionUse => ({
  graph: "g",
  name: "kitchen",
  seq: 1,
  count: 1,
  changed: true,
  difference: null,
  suggested: NO_RENAMES,
  ...more,
});
const uses = [
  use({ suggested: { inputs: [["speed", "velocity"]], outputs: [["done", "ended"]] } }),
  use({
    suggested: {
      inputs: [
        ["speed", "velocity"],
        ["rate", "velocity"],
      ],
      outputs: [],
    },
  }),
];

test("a rename that several graphs suggest is listed once", () => {
  expect(suggestedRenames(uses)).toEqual([
    { side: "in", from: "speed", to: "velocity", graphs: 2 },
    { side: "out", from: "done", to: "ended", graphs: 1 },
    { side: "in", from: "rate", to: "velocity", graphs: 1 },
  ]);
});

test("only chosen renames are made, and two parameters never become one", () => {
  const all = suggestedRenames(uses);
  expect(renamesOf(new Set(), all)).toEqual(NO_RENAMES);
  const [speed, done, rate] = all;
  if (!speed || !done || !rate) throw new Error("they are there");
  const ticked = new Set([keyOfRename(speed), keyOfRename(done)]);
  expect(renamesOf(ticked, all)).toEqual({
    inputs: [["speed", "velocity"]],
    outputs: [["done", "ended"]],
  });
  expect(clashes(rate, ticked, all)).toBe(true);
  expect(clashes(done, ticked, all)).toBe(false);
});

test("other renames can be chosen where types allow it", () => {
  const [number, text] = ['{"pvf_type":"number"}', '{"pvf_type":"string"}'];
  const fields = [
    { field: "in/speed", before: number, after: null },
    { field: "in/velocity", before: null, after: number },
    { field: "in/rate", before: null, after: number },
    { field: "in/note", before: null, after: text },
    { field: "out/done", before: null, after: number },
  ];
  const changed = { change: "changed", aid: "a", name: "Drive_0", fields } as const;
  const difference = { before: 1, after: 1, fields: [], relations: [], notes: [] };
  const one = use({ difference: { ...difference, actions: [{ ...changed, fields }] } });
  const known = [{ side: "in", from: "speed", to: "rate", graphs: 1 } as const];
  expect(possibleRenames([one, one], known)).toEqual([
    { side: "in", from: "speed", to: "velocity", graphs: 2 },
  ]);
});
