/** Values as executed stand beside those that were sent, and what nobody saw is not made up. */
import { expect, test } from "vitest";
import type { ActionRun, Visit } from "../api/runs";
import { outputsOfVisits, parametersOfVisits } from "./run-parameters";

function visit(inputs: Visit["inputs"]): Visit {
  const at = "2026-11-20T09:00:00Z";
  return {
    from: at,
    not_before: at,
    not_after: at,
    until: at,
    result: "true",
    how: "observed",
    inputs,
  };
}

function action(...visits: Visit[]): ActionRun {
  return { aid: "a", state: "FINISHED", visits, older: 0, messages: [] };
}

test("neighbouring visits with the same values are one column", () => {
  const found = parametersOfVisits(
    { x: "1" },
    action(visit({ x: "1" }), visit({ x: "1" }), visit({ x: "2" })),
  );
  expect(found.visits).toEqual(["Visits 1–2", "Visit 3"]);
  expect(found.rows).toEqual([{ parameter: "x", sent: "1", ran: ["1", "2"], over: [1, 1, 2] }]);
});

test("numbers that differ over three visits or more are a chart, and nothing else is", () => {
  const over = (...texts: (string | null)[]) =>
    parametersOfVisits({}, action(...texts.map((x) => visit(x === null ? null : { x })))).rows[0]
      ?.over;
  expect(over("0.5", null, "-2", "3e2")).toEqual([0.5, -2, 300]);
  expect(over("1", "2")).toBeUndefined();
  expect(over("1", "1", "1")).toBeUndefined();
  expect(over("1", "2", '"3"')).toBeUndefined();
  expect(over("1", "2", "3…")).toBeUndefined();
});

test("a value that nobody saw is not there, and is counted", () => {
  const found = parametersOfVisits({ x: "1" }, action(visit(null), visit({ x: "1" })));
  expect(found.visits).toEqual(["Visit 2"]);
  expect(found.unseen).toBe(1);
});

test("a parameter without a value in a visit is told apart from one that was not sent", () => {
  const found = parametersOfVisits({ gone: "5" }, action(visit({ come: '"a"' })));
  expect(found.rows).toEqual([
    { parameter: "come", sent: null, ran: ['"a"'] },
    { parameter: "gone", sent: "5", ran: [null] },
  ]);
  expect(found.visits).toEqual(["Ran with"]);
});

test("what an action gave is shown by visit, and never as something that was sent", () => {
  const at = visit({ x: "1" });
  const gave = (y: string): Visit => ({ ...at, outputs: { y } });
  const found = outputsOfVisits(action(gave("1"), at, gave("2"), gave("2")));
  expect(found.visits).toEqual(["Visit 1", "Visits 3–4"]);
  expect(found.rows).toEqual([{ parameter: "y", ran: ["1", "2"], over: [1, 2, 2] }]);
  expect(outputsOfVisits(action(gave("3"))).visits).toEqual(["Gave"]);
  expect(outputsOfVisits(action(at)).rows).toEqual([]);
});
