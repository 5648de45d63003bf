import { expect, test } from "vitest";
import type { Problem } from "../../api/graphs";
import { problemGroups } from "../../graph/problems/problem-groups";
import { fieldOfProblem, firstField, groupsAt } from "./field-problems";

const problem = (path: string, where: object = {}): Problem => ({
  code: "P1",
  severity: "warning",
  message: "",
  where: { path, ...where },
});
const told = (...problems: Problem[]) => problemGroups(problems, { actions: [], relations: [] });

test.each([
  ["/graph_name", "name"],
  ["/actions/3/instance_id", "number"],
  ["/actions/3/input_parameters/pose/x", "in/pose/x"],
  ["/actions/3/input_parameters/pose/x/pvf_value", "in/pose/x"],
  ["/actions/3/output_parameters/a~1b", "out/a~1b"],
  ["/actions/3/parents/0/conditions", "conditions"],
  ["/actions/3/children/1/remap", "remap"],
  ["/actions/3/vendor", null],
  ["", null],
])("a problem at %s is marked at %s", (path, field) => {
  expect(fieldOfProblem(problem(path))).toBe(field);
});

test("a field has the problems of its own thing only, errors first", () => {
  const mild = problem("/actions/0/name", { aid: "a" });
  const bad: Problem = { ...mild, severity: "error" };
  const other = problem("/actions/1/name", { aid: "b" });
  const found = groupsAt(told(mild, other, bad), "a", "name");
  expect(found.flatMap(({ problems }) => problems)).toEqual([bad, mild]);
  expect(groupsAt(told(problem("/graph_name")), "graph", "name")).toHaveLength(1);
});

test("a problem about missing values leads to the first field without one", () => {
  const path = "/actions/0/input_parameters/at/x";
  const [first] = told({ ...problem(path, { aid: "a" }), code: "H8" });
  expect(first && firstField(first)).toBe("in/at/x");
});
