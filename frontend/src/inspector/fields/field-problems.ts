/** Finds the field of a form that a problem is about, so that the problem is shown there. */
import { createContext } from "react";
import type { Problem } from "../../api/graphs";
import type { ProblemGroup } from "../../graph/problems/problem-groups";

export type CheckedGroup = ProblemGroup<Problem>;

/** The problems of the open graph, for the fields of its forms. */
export const ProblemsContext = createContext<readonly CheckedGroup[]>([]);

const MEMBERS: Readonly<Record<string, string>> = {
  name: "name",
  instance_id: "number",
  actor: "robot",
  description: "description",
  type: "type",
  graph_name: "name",
  graph_description: "description",
  conditions: "conditions",
  required: "required",
  remap: "remap",
  remap_parameters: "remap",
};

/** The name of the field, as forms give it; null where no field stands for it. */
export function fieldOfProblem({ where }: Pick<Problem, "where">): string | null {
  const parts = (where.path ?? "").split("/").slice(1);
  const sides = { input_parameters: "in", output_parameters: "out" } as const;
  for (const [i, part] of parts.entries()) {
    if (part === "input_parameters" || part === "output_parameters") {
      const rest = parts.slice(i + 1).filter((each) => !each.startsWith("pvf_"));
      return rest.length === 0 ? null : `${sides[part]}/${rest.join("/")}`;
    }
  }
  // Behind an action or an arrow and its number stands the member.
  return MEMBERS[parts.at(-1) ?? ""] ?? null;
}

/** The field under which it is said: that of the whole where it is about several of one thing. */
export function fieldOfGroup({ group, problems }: CheckedGroup): string | null {
  return group === null ? fieldOfProblem(problems[0]) : `in/${group}`;
}

/** Returns the problems of one field of one thing. */
export function groupsAt(told: readonly CheckedGroup[], of: string, field: string): CheckedGroup[] {
  return told.filter((each) => (each.place ?? "graph") === of && fieldOfGroup(each) === field);
}

/** Returns the field at which a problem shows: the first one; null where only the thing itself is marked. */
export function firstField(told: CheckedGroup): string | null {
  const [input] = told.inputs;
  return input === undefined ? fieldOfGroup(told) : `in/${input}`;
}
