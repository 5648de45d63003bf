/** The library of actions, each a document of its own, as the editor answers it. */
import { keepPreviousData, type QueryClient, useQuery } from "@tanstack/react-query";
import { afterFirstView } from "../clock/first-view";
import { editor } from "./client";
import { type GraphDifference, type GraphSummary, type Preview, queryKeys } from "./graphs";
import { serverPath } from "./page-url";
import type { EditorApi } from "./schema/editor";

/** `document`: its own; null where only graphs use it. `differs_in`: of `used_in`, where parameters are others. */
export type LibraryAction = EditorApi["LibraryAction"];

/** Parameters that are called otherwise now: pairs of paths, the old one first. */
export type Renames = EditorApi["Renames"];

export const NO_RENAMES: Renames = { inputs: [], outputs: [] };

/** A graph that uses the action. `count`: how often; `changed`: whether an update would change it. */
export type ActionUse = EditorApi["ActionUse"];
/** `seq`: the change of the action's document that this was worked out from. */
export type ActionUses = EditorApi["ActionUses"];
export type UpdatedUse = EditorApi["UpdatedGraph"];

const ofAction = (id: string) => ({ action_id: id });

/** Every action of the library, and what else graphs use, by name. */
export function fetchLibrary(signal?: AbortSignal): Promise<LibraryAction[]> {
  return editor.get("/api/actions", { signal });
}

/** The time, ms, for which an answer also serves parts of the page that ask later. */
const ASKED = 10_000;

export function useLibrary() {
  return useQuery({
    queryKey: queryKeys.actions,
    queryFn: ({ signal }) => afterFirstView(signal).then(() => fetchLibrary(signal)),
    refetchInterval: 15_000,
    staleTime: ASKED,
  });
}

/**
 * Return the ids of the other graphs with an action that stands for a graph. If the library has an
 * action of that name, it is meant instead of the graph.
 */
export function usedIn(
  actions: readonly LibraryAction[],
  graph: { readonly id: string; readonly name: string },
): readonly string[] {
  const found = actions.find(({ name, document }) => document === null && name === graph.name);
  return (found?.used_in ?? []).filter((each) => each !== graph.id);
}

/** A graph as the action that stands for it in another: what its first actions lack, what its last one gives. */
export type GraphAsAction = EditorApi["GraphAsAction"];

export function useGraphsAsActions() {
  return useQuery({
    queryKey: [...queryKeys.actions, "graphs"],
    queryFn: ({ signal }) =>
      afterFirstView(signal).then(() => editor.get("/api/actions/graphs", { signal })),
    refetchInterval: 30_000,
    staleTime: ASKED,
  });
}

/** Result of the last build of the package, as reported by a person or tool; null if none was. */
export type ActionBuild = EditorApi["ActionBuilt"];

export function useLastBuild(id: string) {
  return useQuery({
    queryKey: ["build", id],
    queryFn: ({ signal }) =>
      editor.get("/api/actions/{action_id}/build", { path: ofAction(id), signal }),
    refetchInterval: 15_000,
  });
}

/** Actions that were deleted and can be brought back. */
export function useDeletedActions(wanted: boolean) {
  return useQuery({
    enabled: wanted,
    queryKey: [...queryKeys.actions, "deleted"],
    queryFn: ({ signal }) => editor.get("/api/actions/deleted", { signal }),
  });
}

/** Make an action of the library. `fromGraphs`: with what graphs know of it, instead of empty. */
export function createAction(name: string, fromGraphs = false): Promise<GraphSummary> {
  const body = fromGraphs ? { name, from_graphs: true } : { name };
  return editor.post("/api/actions", { body, status: 201 });
}

export function previewAction(text: string): Promise<Preview> {
  return editor.post("/api/actions", { query: { preview: true }, body: text, status: 200 });
}

/** Takes in the file of one action as it is. */
export function importAction(text: string): Promise<GraphSummary> {
  return editor.post("/api/actions", { body: text, status: 201 });
}

/** Makes an action that the library has what its file says; with `seq` only while that is its last change. */
export function replaceAction(id: string, text: string, seq?: number): Promise<GraphSummary> {
  const request = { path: ofAction(id), query: { seq }, body: text };
  return editor.put("/api/actions/{action_id}/umrf", request);
}

/** Return the changes that a file would make to an action. */
export function compareWithFile(id: string, text: string): Promise<GraphDifference> {
  return editor.post("/api/actions/{action_id}/umrf", { path: ofAction(id), body: text });
}

/** Return the address from which the browser downloads the file of an action. */
export function actionDownload(id: string): string {
  return serverPath(`/api/actions/${encodeURIComponent(id)}/umrf`);
}

function renamesQuery({ inputs, outputs }: Renames): URLSearchParams {
  const query = new URLSearchParams();
  const pair = ([from, to]: readonly [string, string]) =>
    `${encodeURIComponent(from)}:${encodeURIComponent(to)}`;
  for (const each of inputs) query.append("inputs", pair(each));
  for (const each of outputs) query.append("outputs", pair(each));
  return query;
}

/** Query what updating each graph to the parameters of the document would change. */
export function useActionUses(id: string, renames: Renames) {
  const query = renamesQuery(renames);
  return useQuery({
    queryKey: ["uses", id, query.toString()],
    queryFn: ({ signal }) =>
      editor.get("/api/actions/{action_id}/uses", { path: ofAction(id), query, signal }),
    placeholderData: keepPreviousData,
    staleTime: 0,
    gcTime: 0,
    refetchOnWindowFocus: false,
  });
}

export function refreshUses(client: QueryClient, id: string): Promise<void> {
  return client.invalidateQueries({ queryKey: ["uses", id] });
}

interface Updating {
  readonly seq: number;
  readonly graphs: readonly { readonly graph: string; readonly seq: number }[];
  readonly renames: Renames;
}

export function updateUses(id: string, body: Updating): Promise<UpdatedUse[]> {
  const request = { path: ofAction(id), body, timeoutMs: 60_000 };
  return editor.post("/api/actions/{action_id}/uses", request);
}

/** The document takes over the parameters that a graph's use of it has. */
export function takeFromGraph(id: string, graph: string): Promise<GraphSummary> {
  return editor.post("/api/actions/{action_id}/take", { path: ofAction(id), body: { graph } });
}
