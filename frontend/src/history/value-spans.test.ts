import { expect, test } from "vitest";
import type { Version } from "../api/graphs";
import type { FieldValue } from "../api/history";
import type { ListedRun } from "../api/review";
import { factsOf, overwrittenOf, runNumbers, spansOf } from "./value-spans";

const value = (is: unknown, seq: number): FieldValue => ({
  value: is === null ? null : JSON.stringify({ pvf_type: "number", pvf_value: is }),
  ...{ before: null, author: { id: "ada", name: "Ada" }, at: "2026-11-23T12:00:00Z", seq },
});
const version = (id: string, seq: number) => ({ id, seq }) as Version;
const run = (number: number, of: string, result: string | null, took?: [number, number | null]) =>
  ({
    ...{ number, version: of, result, state: "finished", ended_at: "2026-11-23T12:00:00Z" },
    took: took ? { least: took[0], most: took[1] } : null,
  }) as ListedRun;

const values = [value(0.9, 12), value(0.4, 5), value(0.3, 2)];
const versions = [version("c", 12), version("b", 11), version("a", 4)];
const runs = [
  run(41, "c", "on_true", [12.1, 12.4]),
  run(40, "b", "on_error", [22, 23]),
  run(38, "b", "on_true", [24, 25]),
  run(21, "a", "on_true"),
  run(20, "elsewhere", "on_true"),
];

test("a run belongs to the value that its version has", () => {
  const spans = spansOf("in/speed", values, versions, runs);
  expect(spans.map(({ text, number, runs: its }) => [text, number, runNumbers(its)])).toEqual([
    ["0.3", 0.3, "run 21"],
    ["0.4", 0.4, "runs 38–40"],
    ["0.9", 0.9, "run 41"],
  ]);
});

test("what is told of a value is what its runs did", () => {
  expect(factsOf(spansOf("in/speed", values, versions, runs))).toEqual([
    { text: "0.9", words: "1 run, true; 12–12 s. One run proves little.".replace("12–12", "12") },
    { text: "0.4", words: "2 runs, 1 true, 1 error; 22–25 s." },
    { text: "0.3", words: "1 run, true. One run proves little." },
  ]);
});

test("a value that came back has the runs of both times", () => {
  const back = [value(0.3, 13), ...values];
  const [first] = factsOf(
    spansOf("in/speed", back, [version("d", 13), ...versions], [run(42, "d", "on_error"), ...runs]),
  );
  expect(first).toEqual({ text: "0.3", words: "2 runs, 1 true, 1 error." });
});

test("what is no number is no number", () => {
  const spans = spansOf("in/to", [value("office", 3), value(null, 2), value("1e9 m", 1)], [], []);
  expect(spans.map(({ number }) => number)).toEqual([null, null, null]);
});

test("a value that was overwritten at once has no runs, and takes none from the one that stayed", () => {
  const lost = { ...value(0.7, 6), before: value(0.4, 5).value, overwritten: true };
  const all = [value(0.9, 12), lost, value(0.4, 5), value(0.3, 2)];
  expect(spansOf("in/speed", all, versions, runs)).toEqual(
    spansOf("in/speed", values, versions, runs),
  );
  const [only, ...others] = overwrittenOf("in/speed", all);
  expect([only?.text, only?.stayed, others.length]).toEqual(["0.7", "0.4", 0]);
});
