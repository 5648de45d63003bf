/** Rules that say who may see and who may edit a graph, or the graphs in a folder. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, renewing, runnerAt } from "./client";
import { refreshGraphs } from "./graphs";
import { errorText } from "./http";
import type { EditorApi } from "./schema/editor";

export type Rule = EditorApi["Rule"];
/** Ids of persons and groups, or everybody. */
export type Who = Rule["readers"];
/** `own`: null where the rule of the folder around counts; `around`: the one that counts then. */
export type RuleView = EditorApi["RuleView"];

export interface Ruled {
  readonly kind: "graph" | "folder";
  readonly id: string;
}

const key = ({ kind, id }: Ruled) => ["rule", kind, id] as const;

export function useRule(ruled: Ruled) {
  const { kind, id } = ruled;
  return useQuery({
    queryKey: key(ruled),
    queryFn: ({ signal }) =>
      kind === "graph"
        ? editor.get("/api/graphs/{graph_id}/rule", { path: { graph_id: id }, signal })
        : editor.get("/api/folders/{folder_id}/rule", { path: { folder_id: id }, signal }),
  });
}

/** Brings the rules of all graphs to a runner, which may have a data folder of its own. */
export async function tellRunnerRules(runner: string | undefined): Promise<void> {
  if (runner === undefined) return;
  const body = await editor.get("/api/graph-rules", {});
  if (body.at === 0) return; // there was never a rule
  try {
    await runnerAt(runner).put("/api/graph-rules", { body });
  } catch (error) {
    throw new Error(
      `Done at the editor. A runner with a data folder of its own was not told: ${errorText(error)}`,
    );
  }
}

/** Stores the own rule of a graph or folder at the editor and the runner; null: it has none. */
export function usePutRule(ruled: Ruled, runner: string | undefined, onDone: () => void) {
  const client = useQueryClient();
  const { kind, id } = ruled;
  return useMutation({
    mutationFn: async (rule: Rule | null) => {
      const body = { rule };
      await (kind === "graph"
        ? editor.put("/api/graphs/{graph_id}/rule", { path: { graph_id: id }, body })
        : editor.put("/api/folders/{folder_id}/rule", { path: { folder_id: id }, body }));
      await tellRunnerRules(runner);
    },
    onSuccess: onDone,
    onSettled: renewing(() =>
      Promise.all([client.invalidateQueries({ queryKey: ["rule"] }), refreshGraphs(client)]),
    ),
  });
}
