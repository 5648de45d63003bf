/** The graphs inside of a graph, by value: what goes along with starts, looks and expected courses. */
import { useQuery } from "@tanstack/react-query";
import type { RunBreakpoint } from "../graph/breakpoints";
import { editor } from "./client";
import type { GraphSummary } from "./graphs";
import type { Inside } from "./runs";
import type { EditorApi } from "./schema/editor";

const inGraph = (graph: string) => ({ graph_id: graph });

interface Pinned {
  subgraphs?: Inside["subgraphs"] | null | undefined;
  tree_digest?: string | null | undefined;
}

/** Return the sub-graphs of a version, a run or a moment, in the form of a request. */
export function insideOf({ subgraphs, tree_digest }: Pinned): Inside {
  if (!subgraphs?.length || !tree_digest) return {};
  return { subgraphs, tree_digest };
}

/** Fetch the sub-graphs of a moment as they are now. */
export async function fetchInside(
  graph: string,
  seq: number,
  signal?: AbortSignal,
): Promise<Inside> {
  const request = { path: inGraph(graph), query: { at: seq }, signal };
  return insideOf(await editor.get("/api/graphs/{graph_id}/subgraphs", request));
}

/**
 * Fetch the breakpoints that the graphs inside of a moment, or of a version that is started once more, have now: a
 * start that opens them names these.
 */
export async function fetchBreakpointsInside(
  graph: string,
  seq: number,
  version: string | undefined,
  signal?: AbortSignal,
): Promise<RunBreakpoint[]> {
  const all: RunBreakpoint[] =
    version === undefined
      ? await editor.get("/api/graphs/{graph_id}/breakpoints", {
          ...{ path: inGraph(graph), query: { at: seq, inside: true }, signal },
        })
      : await editor.get("/api/versions/{version_id}/breakpoints", {
          ...{ path: { version_id: version }, signal },
        });
  return all.filter(({ inside }) => Boolean(inside));
}

/** Gives the actions that stand for a graph in these others its new name. Answers where there were some. */
export function callUses(
  graph: string,
  body: EditorApi["CallingUses"],
): Promise<EditorApi["CalledUses"]> {
  const request = { path: inGraph(graph), body, timeoutMs: 60_000 };
  return editor.post("/api/graphs/{graph_id}/uses", request);
}

/** A graph and those inside of it as one graph that does the same, or why there is none. */
export type FlatGraph = EditorApi["FlatGraph"];
/** Reason why a graph cannot be flattened, with the action and level that it is about. */
export type FlatteningReason = EditorApi["FlatteningReason"];

/** Query the flattened graph, each time anew: sub-graphs may have changed. */
export function useFlatGraph(graph: string) {
  return useQuery({
    queryKey: ["graphs", graph, "flat"],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/{graph_id}/flat", { path: inGraph(graph), signal }),
    staleTime: 0,
    gcTime: 0,
  });
}

export function makeFlatGraph(graph: string, body: EditorApi["FlatCopy"]): Promise<GraphSummary> {
  return editor.post("/api/graphs/{graph_id}/flat", { path: inGraph(graph), body });
}

/** The sub-graph that chosen actions would become, or the reason why they cannot. */
export type ExtractionLook = EditorApi["ExtractionLook"];
type ExtractionWish = EditorApi["Extracting"];

export function lookAtExtraction(graph: string, body: ExtractionWish): Promise<ExtractionLook> {
  return editor.post("/api/graphs/{graph_id}/extraction", { path: inGraph(graph), body });
}

/** A new graph of them; the graph around it is changed by who asks. */
export function makeSubGraph(
  graph: string,
  body: ExtractionWish,
): Promise<EditorApi["MadeSubGraph"]> {
  return editor.post("/api/graphs/{graph_id}/subgraphs", { path: inGraph(graph), body });
}

/** The graph after an action is replaced by the actions of its sub-graph. */
export type UnpackingLook = EditorApi["UnpackingLook"];

export function lookAtUnpacking(
  graph: string,
  body: EditorApi["UnpackingAction"],
): Promise<UnpackingLook> {
  return editor.post("/api/graphs/{graph_id}/unpacking", { path: inGraph(graph), body });
}
