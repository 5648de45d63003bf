import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsFrom, mapsOf } from "../document-keys";
import { addAction, connect } from "../edit";
import { readGraph } from "../read";
import { problemGroups } from "./problem-groups";
import { type CheckedProblem, countsOf, countWords, kindOf } from "./problem-kinds";

const problem = (code: string, path = "", more: Partial<CheckedProblem> = {}): CheckedProblem => ({
  code,
  severity: "error",
  message: `about ${code} ${path}`,
  where: { path, aid: "a" },
  ...more,
});
const EMPTY = { actions: [], relations: [] };

test.each([
  ["H7", "/actions/0/input_parameters/place", "error", "fill-in"],
  ["H8", "/actions/0/input_parameters/place", "error", "fill-in"],
  ["H8", "/actions/0/parents/0/required", "error", "wrong"],
  ["no-entry", "", "error", "fill-in"],
  ["no-exit", "", "warning", "fill-in"],
  ["parameter-allowed", "/actions/0/input_parameters/a/pvf_value", "warning", "wrong"],
  ["H4", "/actions/0", "warning", "warning"],
  ["H3", "/actions/0", "warning", "note"],
  ["H2", "/actions/0", "error", "wrong"],
] as const)("%s at %s, %s: %s", (code, path, severity, kind) => {
  expect(kindOf(problem(code, path, { severity }))).toBe(kind);
});

/** Grip, whose pose nobody gives, and whose colour comes as a number. */
function grip() {
  const doc = new Y.Doc();
  const number = '{"pvf_type": "number"}';
  const inputs = ["x", "y", "z"].map((axis) => ({ path: `at/position/${axis}`, text: number }));
  const colour = { path: "colour", text: '{"pvf_type": "string"}' };
  const from = addAction(doc, { name: "Look", outputs: [{ path: "colour", text: number }] });
  const key = addAction(doc, { name: "Grip", inputs: [...inputs, colour] });
  connect(doc, from, key);
  return { key, graph: readGraph(mapsOf(doc)) };
}

test("a pose that is not written is one thing to fill in, and says what of it", () => {
  const { key, graph } = grip();
  const at = (axis: string) =>
    problem("H8", `/actions/1/input_parameters/at/position/${axis}`, {
      where: {
        path: `/actions/1/input_parameters/at/position/${axis}`,
        aid: key,
      },
    });
  const told = problemGroups([at("x"), at("z")], graph);
  expect(told.map(({ kind, message, inputs }) => [kind, message, inputs])).toEqual([
    [
      "fill-in",
      "at: position.x and position.z still to fill in, here or at each start.",
      ["at/position/x", "at/position/z"],
    ],
  ]);
});

test("an input that gets what it cannot take is wrong, not just to fill in", () => {
  const { key, graph } = grip();
  const path = "/actions/1/input_parameters/colour";
  const [told] = problemGroups([problem("H8", path, { where: { path, aid: key } })], graph);
  expect(told?.kind).toBe("wrong");
});

test("two equal problems of one place are told once, and errors come first", () => {
  const risk = problem("H3", "/actions/0/parents/0", { severity: "warning", message: "may abort" });
  const again = { ...risk, where: { path: "/actions/0/parents/1", aid: "a" } };
  const told = problemGroups([risk, again, problem("no-exit"), problem("H2")], EMPTY);
  expect(told.map(({ code, problems }) => [code, problems.length])).toEqual([
    ["H2", 1],
    ["no-exit", 1],
    ["H3", 2],
  ]);
  expect(countWords(countsOf(told))).toEqual(["1 wrong", "1 to fill in"]);
});

const file = new URL("../../../../tests/vectors/problem-kinds.json", import.meta.url);

interface Vectors {
  readonly kinds: readonly [string, "error" | "warning", string, string][];
  readonly graphs: readonly {
    readonly about: string;
    readonly maps: Parameters<typeof mapsFrom>[0];
    readonly problems: readonly CheckedProblem[];
    readonly wrong: number;
    readonly to_fill_in: number;
  }[];
}

const vectors = JSON.parse(readFileSync(fileURLToPath(file), "utf8")) as Vectors;

test.each(vectors.kinds)("as the vectors say, %s, %s at %s: %s", (code, severity, path, kind) => {
  expect(kindOf(problem(code, path, { severity }))).toBe(kind);
});

test.each(vectors.graphs)("as many of each as the vectors say: $about", (vector) => {
  const told = problemGroups(vector.problems, readGraph(mapsFrom(vector.maps)));
  const { wrong, fillIn } = countsOf(told);
  expect({ wrong, to_fill_in: fillIn }).toEqual({
    wrong: vector.wrong,
    to_fill_in: vector.to_fill_in,
  });
});

test("problems call actions as their cards do", () => {
  const doc = new Y.Doc();
  addAction(doc, { name: "AaConfirm" });
  addAction(doc, { name: "Grip" });
  addAction(doc, { name: "Grip" });
  const message = "AaConfirm_0 waits for Grip_1, Grip_0 and Lift_0.";
  const [told] = problemGroups([problem("H2", "", { message })], readGraph(mapsOf(doc)));
  expect(told?.message).toBe("Confirm waits for Grip 1, Grip and Lift_0.");
});
