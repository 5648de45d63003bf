import fc from "fast-check";
import { expect, test } from "vitest";
import type { ComparedStep, Comparison } from "../../api/review";
import type { Visit } from "../../api/runs";
import { comparedActions, differencesOf, likelyCause, overlap, sameAsSeen } from "./differences";

const iso = (s: number) => new Date(s * 1000).toISOString();
const visit = (from: number, until: number, result: Visit["result"], latest = until): Visit => ({
  from: iso(from),
  not_before: iso(from),
  until: iso(until),
  not_after: iso(latest),
  result,
  how: "observed",
  inputs: null,
});
const step = (action: string, part: Partial<ComparedStep>): ComparedStep => ({
  action,
  aid: action,
  visit: 1,
  a: null,
  b: null,
  relation: "same",
  slower: null,
  ...part,
});
const comparison = (steps: ComparedStep[], part: Partial<Comparison> = {}): Comparison => {
  const first = steps.find(({ relation }) => /result|only/.test(relation));
  return {
    a: { number: 41, engine: "atlas" },
    b: { number: 43, engine: "atlas" },
    same_graph: true,
    same_engine: true,
    graph: { before: 0, after: 0, fields: [], actions: [], relations: [], notes: [] },
    parameters: [],
    steps,
    left_out: 0,
    parting: first ? { step: first, text: "", messages_a: [], messages_b: [] } : null,
    text: "",
    ...part,
  } as unknown as Comparison;
};
const closes = step("Close_0", {
  a: visit(0, 3, "true"),
  b: visit(0, 4.5, "false"),
  relation: "result",
});

test("the first difference is numbered 1, and those after it follow in the order of the steps", () => {
  const report = step("Report_0", { a: visit(5, 6, "true"), relation: "only_a" });
  const found = differencesOf(comparison([step("Drive_0", {}), closes, report]));
  expect(found.map(({ number, title }) => `${number} ${title}`)).toEqual([
    "1 Close 0 ended false",
    "2 Report 0 ran only in run 41",
  ]);
  expect(found[0]?.text).toBe("After 4.5 s. In run 41 it ended true after 3.0 s.");
});

test("ranges that overlap are said to be no difference", () => {
  const drive = step("Drive_0", {
    a: visit(0, 12, "true", 12.3),
    b: visit(0, 12.1, "true", 12.4),
  });
  expect(sameAsSeen(comparison([drive]))).toEqual([
    { name: "Drive 0", text: "12.1–12.4 s and 12.0–12.3 s overlap: no difference is claimed" },
  ]);
  const ms = fc.nat(10_000);
  fc.assert(
    fc.property(ms, ms, ms, ms, (a, b, c, d) => {
      const [x, y] = [
        { least: Math.min(a, b), most: Math.max(a, b) },
        { least: Math.min(c, d), most: Math.max(c, d) },
      ];
      expect(overlap(x, y)).toBe(overlap(y, x));
      if (!overlap(x, y)) expect(x.most < y.least || y.most < x.least).toBe(true);
    }),
  );
});

test("what is not known to differ is no difference: an end that one run did not show", () => {
  const unknown = step("Close_0", { a: visit(0, 3, null), b: visit(0, 3, "true") });
  expect(differencesOf(comparison([{ ...unknown, relation: "unknown" }]))).toEqual([]);
  expect(differencesOf(comparison([{ ...unknown, relation: "end" }]))).toEqual([]);
});

test("the likely cause is the nearest thing that differed, and none where nothing did", () => {
  expect(likelyCause(comparison([closes]))).toBeNull();
  expect(likelyCause(comparison([closes], { same_engine: false }))).toContain("atlas");
  const changed = {
    before: 0,
    after: 0,
    fields: [],
    relations: [],
    notes: [],
    actions: [
      {
        change: "changed" as const,
        aid: "Close_0",
        name: "Close",
        fields: [
          { field: "position", before: 1, after: 2 },
          { field: "in/torque", before: '{"pvf_value":12.5}', after: '{"pvf_value":8.0}' },
        ],
      },
    ],
  };
  expect(likelyCause(comparison([closes], { graph: changed }))).toBe(
    "its torque was 8 instead of 12.5",
  );
});

test("visits of one action are told together, their durations as the range of their sum", () => {
  const again = step("Close_0", { visit: 2, b: visit(5, 6, "error", 7), relation: "only_b" });
  expect(comparedActions(comparison([closes, again]))).toMatchObject([
    {
      a: { results: ["true"], took: { least: 3_000, most: 3_000 } },
      b: { results: ["false", "error"], took: { least: 5_500, most: 6_500 } },
    },
  ]);
});
