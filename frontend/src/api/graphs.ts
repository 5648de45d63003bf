/** Graphs, versions and problems as the editor answers them. */
import { type QueryClient, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect } from "react";
import { afterFirstView } from "../clock/first-view";
import { editor, runnerAt } from "./client";
import { fetchAnswer, fetchText } from "./http";
import type { EditorApi } from "./schema/editor";

/** `people`: who is in it now. */
export type GraphSummary = EditorApi["GraphView"];
export type VersionAuthor = EditorApi["PersonRef"];
export type Version = EditorApi["VersionView"];
/** A place: a JSON pointer into a text, with line and column where that text is known. */
export type ProblemPlace = EditorApi["Where"];
/** `also`: the other places of the same thing, which is told once. */
export type Problem = EditorApi["Problem"];
export type Problems = EditorApi["Problems"];
/** Differences between two moments of a document. */
export type GraphDifference = EditorApi["Difference"];

const inGraph = (id: string) => ({ graph_id: id });

export const queryKeys = {
  graphs: ["graphs"] as const,
  pages: ["graph pages"] as const,
  names: ["graph names"] as const,
  thumbnail: (graph: string) => ["graph thumbnails", graph] as const,
  labels: ["graph labels"] as const,
  deleted: ["deleted graphs"] as const,
  folders: ["folders"] as const,
  actions: ["actions"] as const,
  graph: (id: string) => ["graphs", id] as const,
  problems: (id: string, seq: number) => ["graphs", id, "problems", seq] as const,
  versions: (id: string) => ["graphs", id, "versions"] as const,
  version: (id: string) => ["versions", id] as const,
};

/** Graphs that were deleted and can be brought back, those that changed last first. */
export function useDeletedGraphs(wanted: boolean) {
  return useQuery({
    enabled: wanted,
    queryKey: queryKeys.deleted,
    queryFn: ({ signal }) => editor.get("/api/graphs", { query: { deleted: true }, signal }),
  });
}

/** The versions of a graph, newest first; read again when `wanted` is not among them. */
export function useVersions(graph: string, wanted: string | null = null) {
  const client = useQueryClient();
  const versions = useQuery({
    enabled: graph !== "",
    queryKey: queryKeys.versions(graph),
    queryFn: async ({ signal }) => {
      await afterFirstView(signal);
      return editor.get("/api/graphs/{graph_id}/versions", { path: inGraph(graph), signal });
    },
    staleTime: 2_000, // parts of one screen ask one after the other
  });
  const missing =
    wanted !== null && versions.data?.every((version) => version.id !== wanted) === true;
  useEffect(() => {
    if (missing) void client.invalidateQueries({ queryKey: queryKeys.versions(graph) });
  }, [missing, client, graph]);
  return versions;
}

/** Problems of the moment `seq`; the last known ones stay until the next answer is there. */
export function useProblems(graph: string, seq: number) {
  return useQuery({
    queryKey: queryKeys.problems(graph, seq),
    queryFn: async ({ signal }) => {
      await afterFirstView(signal);
      const request = { path: inGraph(graph), query: { seq }, signal };
      return editor.get("/api/graphs/{graph_id}/problems", request);
    },
    enabled: seq > 0,
    placeholderData: (before) => before,
    staleTime: Number.POSITIVE_INFINITY,
    refetchInterval: 8_000, // graphs inside of it may change
  });
}

type Place = string | null | undefined;

/** Make an empty graph. `folder`: the folder in which it is made, if any; likewise for imports and copies. */
export function createGraph(name: string, folder: Place): Promise<GraphSummary> {
  return editor.post("/api/graphs", { query: { folder }, body: { name }, status: 201 });
}

/**
 * Result that importing a file would have; nothing is stored. Places are those of the file.
 * `notes`: translations, and members without a place; `remarks` are the same with their places.
 */
export type Preview = EditorApi["Preview"];

/** Imports a file's text as it is. */
export function importGraph(text: string, folder?: Place, of?: string): Promise<GraphSummary> {
  const query = { folder, copy_of: of };
  return editor.post("/api/graphs", { query, body: text, status: 201 });
}

/** An edit of the graph's own document: whoever has it open sees it. */
export function renameGraph(id: string, name: string): Promise<GraphSummary> {
  return editor.patch("/api/graphs/{graph_id}", { path: inGraph(id), body: { name } });
}

/** Copy a graph under another name into its folder; edits of one do not touch the other. */
export async function duplicateGraph(graph: GraphSummary, name: string): Promise<GraphSummary> {
  const made = await importGraph(await graphText(graph.id), graph.folder, graph.id);
  try {
    return await renameGraph(made.id, name);
  } catch (error) {
    await deleteGraph(made.id); // two of one name would be worse than none
    throw error;
  }
}

export function deleteGraph(id: string): Promise<void> {
  return editor.delete("/api/graphs/{graph_id}", { path: inGraph(id) });
}

/** Brings a deleted graph back. */
export function recoverGraph(id: string): Promise<unknown> {
  return editor.post("/api/graphs/{graph_id}/recover", { path: inGraph(id) });
}

function graphText(id: string): Promise<string> {
  return fetchText(`/api/graphs/${encodeURIComponent(id)}/umrf`);
}

/** The version of what the page shows at `seq`, as text, because its numbers must stay as written. */
export function publish(graph: string, seq: number): Promise<string> {
  return fetchText(`/api/graphs/${encodeURIComponent(graph)}/versions`, {
    method: "POST",
    body: { seq },
  });
}

export function authorName(author: VersionAuthor | null | undefined): string {
  return author?.name || "somebody";
}

/** Return the name of a version: its label, else its number among those of its graph. */
export function versionName(versions: readonly Version[] | undefined, id: string | null): string {
  const at = versions?.findIndex((version) => version.id === id) ?? -1;
  const version = versions?.[at];
  if (!versions || !version) return "";
  return version.label || `v${versions.length - at}`;
}

export async function refreshGraphs(client: QueryClient): Promise<void> {
  await Promise.all([
    client.invalidateQueries({ queryKey: queryKeys.graphs, exact: true }),
    client.invalidateQueries({ queryKey: queryKeys.pages }),
    client.invalidateQueries({ queryKey: queryKeys.names }),
    client.invalidateQueries({ queryKey: queryKeys.labels }),
    client.invalidateQueries({ queryKey: queryKeys.deleted }),
    client.invalidateQueries({ queryKey: queryKeys.folders }),
  ]);
}

export function refreshLibrary(client: QueryClient): Promise<void> {
  return client.invalidateQueries({ queryKey: queryKeys.actions });
}

const below = (graph: string) => `/api/graphs/${encodeURIComponent(graph)}`;

export function publishNamed(graph: string, body: EditorApi["Publishing"]): Promise<Version> {
  return editor.post("/api/graphs/{graph_id}/versions", { path: inGraph(graph), body });
}

/** Releases a version, or withdraws that, at the editor and at a runner with a data folder of its own. */
export async function setReleased(
  runner: string | undefined,
  { id, digest, tree_digest }: Version,
  isReleased: boolean,
): Promise<void> {
  const path = { version_id: id };
  const at = runner === undefined ? undefined : runnerAt(runner);
  if (!isReleased) {
    // Each withdraws it by itself, whatever the other says.
    const outcomes = await Promise.allSettled([
      editor.delete("/api/versions/{version_id}/release", { path }),
      at?.delete("/api/releases/{version}", { path: { version: id } }),
    ]);
    for (const outcome of outcomes) if (outcome.status === "rejected") throw outcome.reason;
    return;
  }
  const { released } = await editor.put("/api/versions/{version_id}/release", { path });
  if (!released) throw new Error("The editor has not released it.");
  const body = { version: id, digest: tree_digest ?? digest, ...released };
  await at?.put("/api/releases/{version}", { path: { version: id }, body });
}

/** A graph as it was after a change, as another one; edits of one do not touch the other. */
export async function copyMoment(graph: string, at: number, name: string): Promise<GraphSummary> {
  const text = await fetchText(`${below(graph)}/umrf?at=${at}`);
  const made = await importGraph(text, null, graph);
  try {
    return await renameGraph(made.id, name);
  } catch (error) {
    await deleteGraph(made.id); // two of one name would be worse than none
    throw error;
  }
}

/** A graph inside of a version: as it was then, and what its name stands for now. */
export type PinnedGraph = EditorApi["PinnedGraph"];

/** One version with all that it has by value. */
export function fetchVersion(id: string, signal: AbortSignal): Promise<Version> {
  return editor.get("/api/versions/{version_id}", { path: { version_id: id }, signal });
}

export function previewGraph(text: string): Promise<Preview> {
  return editor.post("/api/graphs", { query: { preview: true }, body: text, status: 200 });
}

/** The text that a route answers, and which moment of the graph it is of. */
async function fetchMoment(url: string): Promise<{ text: string; seq: number }> {
  const response = await fetchAnswer(url);
  return { text: await response.text(), seq: Number(response.headers.get("x-seq")) };
}

/** The text of a graph as it is, and the moment that it is of. */
export function graphMoment(id: string): Promise<{ text: string; seq: number }> {
  return fetchMoment(`/api/graphs/${encodeURIComponent(id)}/umrf`);
}

/** One key of the document; a value that is not there is `undefined`. */
export type KeyChange = EditorApi["KeyChange"];
/** Changes that an edited text would make, and the errors that would come with them. */
export type TextChanges = EditorApi["TextEdit"];

/**
 * Return the changes that a text, edited from that of the moment `seq`, would make. Nothing is
 * stored.
 */
export function textChangesOf(id: string, seq: number, text: string): Promise<TextChanges> {
  const request = { path: inGraph(id), query: { seq }, body: text };
  return editor.post("/api/graphs/{graph_id}/rewriting", request);
}

export type UmrfKeys = EditorApi["Pieces"];

export function readUmrfKeys(text: string): Promise<UmrfKeys> {
  return editor.post("/api/pieces", { body: text });
}
