/** Which field of a form a problem is about, so that it is marked there. */
import { createContext } from "react";
import type { Problem } from "../../api/graphs";
import { bySeverity, markedKeyOf } from "../../canvas/problem-marks";

/** The problems of the open graph, for the fields of its forms. */
export const ProblemsContext = createContext<readonly Problem[]>([]);

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
export function fieldOfProblem({ where }: Problem): string | null {
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

/** What is wrong with one field of one thing, the errors first. */
export function problemsAt(problems: readonly Problem[], of: string, field: string): Problem[] {
  return bySeverity(problems).filter(
    (problem) => (markedKeyOf(problem) ?? "graph") === of && fieldOfProblem(problem) === field,
  );
}
