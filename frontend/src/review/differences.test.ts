import fc from "fast-check";
import { expect, test } from "vitest";
import type { ComparedStep, Comparison } from "../api/review";
import type { Visit } from "../api/runs";
import {
  causeSentence,
  comparedActions,
  differenceCount,
  differencesOf,
  likelyCause,
  outermostAid,
  overlap,
  sameAsSeen,
  spokenOf,
  valueDifferences,
} from "./differences";

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
  levels: [],
  name: action,
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
    subgraphs: [],
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
    "1 Close ended false",
    "2 Report ran only in run 41",
  ]);
  expect(found[0]?.text).toBe("After 4.5 s. In run 41 it ended true after 3.0 s.");
});

test("ranges that overlap are said to be no difference", () => {
  const drive = step("Drive_0", {
    a: visit(0, 12, "true", 12.3),
    b: visit(0, 12.1, "true", 12.4),
  });
  expect(sameAsSeen(comparison([drive]))).toEqual([
    { name: "Drive", text: "12.1–12.4 s and 12.0–12.3 s overlap: no difference is claimed" },
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
  const missing = { ...closes, b: null, relation: "only_a" as const };
  expect(likelyCause(comparison([missing], { graph: changed }))).toBeNull();
  const led = { change: "changed" as const, parent: "Open_0", child: "Close_0" };
  const relations = [{ ...led, fields: [{ field: "on_true", before: "run", after: null }] }];
  const rerouted = { ...changed, relations } as unknown as Comparison["graph"];
  expect(likelyCause(comparison([missing], { graph: rerouted }))).toMatch(/^the arrow .*changed$/);
});

test("what carried two runs out is told apart: by robot, else by whether it was led", () => {
  const ran = (number: number, engine: string, robots?: Record<string, string>) =>
    ({ number, engine, robots }) as unknown as Comparison["a"];
  const apart = (a: Comparison["a"], b: Comparison["b"]) =>
    likelyCause(comparison([closes], { a, b, same_engine: a.engine === b.engine }));
  const led = ran(41, "conducted", { "": "simulator" });
  expect(apart(ran(40, "atlas"), ran(43, "birch"))).toBe("they ran on atlas and on birch");
  const words = "run 41 was led action by action, and run 43 was not";
  expect(apart(led, ran(43, "simulator"))).toBe(words);
  expect(apart(ran(43, "simulator"), led)).toBe(words);
  const other = ran(43, "conducted", { "": "atlas" });
  expect(apart(led, other)).toBe("they ran on simulator and on atlas");
  expect(apart(led, { ...led, number: 43 })).toBeNull();
});

test("what happened on the way comes before any difference of the graphs, and no false cause is named", () => {
  const text = "in run 43 Ada pressed Stop while Close ran (0.7 s)";
  const because = { kind: "operator_stop", run: 43, text };
  const stopped = comparison([closes], { because, same_engine: false });
  expect(causeSentence(stopped)).toBe(`Likely because ${text}.`);
  expect(causeSentence(comparison([], { because }))).toBe(`In${text.slice(2)}.`);
  expect(causeSentence(comparison([]))).toBeNull();
  const arrow = {
    change: "changed" as const,
    parent: "Drive_0",
    child: "Close_0",
    ends: [],
    when: [],
  };
  const fields = [{ field: "waypoints/run", before: null, after: "[]" }];
  const graph = { ...comparison([]).graph, relations: [{ ...arrow, fields }] };
  const moved = comparison([closes], {
    graph,
    same_graph: false,
  } as unknown as Partial<Comparison>);
  expect(causeSentence(moved)).toBe("Nothing that differed before is known to explain it.");
  expect(causeSentence(comparison([closes]))).toBe("Nothing that is known differed before.");
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

test("results that a person gave by word are counted apart in an action's summary", () => {
  const said = { by: { id: "ben", name: "Ben" }, at: "2026-01-01T00:00:00Z", reason: "I saw it" };
  const word = step("Close_0", { visit: 2, b: { ...visit(5, 6, "true", 7), said } as Visit });
  const [found] = comparedActions(comparison([closes, word]));
  expect(found?.a).not.toHaveProperty("said");
  expect(found?.b).toMatchObject({ results: ["false", "true"], said: 1 });
});

test("what is inside of an action stands below it, and what differs there is told with the way", () => {
  const outer = step("Fetch_0", {
    a: visit(0, 9, "true"),
    b: visit(0, 9, "error"),
    relation: "result",
  });
  const inner = { aid: null, levels: ["Fetch_0"] };
  const grip = step("g__Fetch__0/Grip_0", {
    ...inner,
    name: "Grip_0",
    a: visit(1, 3, "true"),
    b: visit(1, 2, "error"),
    relation: "result",
  });
  const lost = step("h__Gone__0/Grip_0", { aid: null, b: visit(8, 9, "true"), relation: "only_b" });
  const close = step("Close_0", { a: visit(9, 10, "true"), relation: "only_a" });
  const found = comparison([grip, outer, close, lost], { subgraphs: ["Fetch"] });
  expect(comparedActions(found).map(({ name, around, holds }) => [name, around, holds])).toEqual([
    ["Fetch_0", null, true],
    ["g__Fetch__0/Grip_0", "Fetch_0", false],
    ["Close_0", null, false],
    ["h__Gone__0/Grip_0", null, false],
  ]);
  expect(differencesOf(found)[0]?.title).toBe("Fetch › Grip ended with an error");
  expect(likelyCause(found)).toBe("the graph inside Fetch was another one");
  expect(outermostAid(found, grip)).toBe("Fetch_0");
});

test("values with which only one of two runs was started are differences, and equal ones are none", () => {
  const [a, b] = [{ Go_0: { place: "x", torque: 5 } }, { Go_0: { place: "x" }, Look_1: { at: 2 } }];
  const found = valueDifferences({ a: { values: a }, b: { values: b } } as unknown as Comparison);
  expect(found.map(({ words, a, b }) => [words, a, b])).toEqual([
    ["Go torque", "5", null],
    ["Look 1 at", null, "2"],
  ]);
  const runs = [a, b].map((values, i) => ({ number: i + 1, engine: "x", values }));
  const ran = comparison([closes], { a: runs[0], b: runs[1] } as unknown as Partial<Comparison>);
  expect(differenceCount(ran)).toBe(3);
  expect(causeSentence(ran)).not.toContain("Nothing that is known differed");
});

test("the verdict calls actions as people do, inside of each other too", () => {
  const steps = [step("AaConfirm_0", {}), step("Lift_1", { levels: ["Fetch_0"] })];
  const text = "The same until AaConfirm_0, then Fetch_0 › Lift_1: true in run 1.";
  expect(spokenOf({ steps }, text)).toBe(
    "The same until Confirm, then Fetch › Lift 1: true in run 1.",
  );
});
