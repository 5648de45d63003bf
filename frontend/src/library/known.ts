/** The actions that can be added: what the graphs of this server use, newest signature first. */
import { useQueries } from "@tanstack/react-query";
import { useMemo } from "react";
import { type GraphSummary, graphText, useGraphs } from "../api/graphs";
import type { NewAction } from "../graph/edit";
import type { Parameter } from "../graph/model";
import { fromUmrf } from "../ui/canvas/from-umrf";
import { pathWords } from "../ui/canvas/value-text";

export interface KnownAction {
  readonly template: NewAction;
  /** In how many graphs. */
  readonly used: number;
}

const MOST_GRAPHS = 60;

/** What a fresh use begins with: the signature, without the values of the place it was found in. */
function bare(parameter: Parameter): Parameter {
  try {
    const fields: unknown = JSON.parse(parameter.text);
    if (typeof fields !== "object" || fields === null || !("pvf_type" in fields)) return parameter;
    const { pvf_value: _, ...rest } = fields as Record<string, unknown>;
    return { path: parameter.path, text: JSON.stringify(rest) };
  } catch {
    return parameter;
  }
}

/** The actions of some UMRF objects, each once, by name. */
export function collect(graphs: readonly unknown[]): KnownAction[] {
  const found = new Map<string, { template: NewAction; graphs: Set<number> }>();
  graphs.forEach((umrf, i) => {
    for (const action of fromUmrf(umrf).actions) {
      const known = found.get(action.name);
      if (known) {
        known.graphs.add(i);
        continue;
      }
      const template: NewAction = {
        name: action.name,
        type: action.type,
        description: action.description,
        inputs: action.inputs.map(bare),
        outputs: action.outputs.map(bare),
      };
      found.set(action.name, { template, graphs: new Set([i]) });
    }
  });
  return [...found.values()]
    .map(({ template, graphs: used }) => ({ template, used: used.size }))
    .sort((a, b) => a.template.name.localeCompare(b.template.name));
}

const byAge = (a: GraphSummary, b: GraphSummary) => b.updated_at.localeCompare(a.updated_at);

export function useKnownActions(): { actions: KnownAction[]; ready: boolean } {
  const graphs = useGraphs();
  const newest = useMemo(
    () => [...(graphs.data ?? [])].sort(byAge).slice(0, MOST_GRAPHS),
    [graphs.data],
  );
  const texts = useQueries({
    queries: newest.map((graph) => ({
      queryKey: ["graphs", graph.id, "umrf"],
      queryFn: () => graphText(graph.id).then((text) => JSON.parse(text) as unknown),
      staleTime: 60_000,
      retry: false,
    })),
    combine: (results) => results.map((result) => result.data),
  });
  const actions = useMemo(() => collect(texts.filter((umrf) => umrf !== undefined)), [texts]);
  return { actions, ready: !graphs.isPending };
}

/** `location, pose.position.x`, for a line under the name. */
export function signature(template: NewAction): string {
  const names = (template.inputs ?? []).map((input) => pathWords(input.path));
  return names.length === 0 ? "no parameters" : names.join(", ");
}
