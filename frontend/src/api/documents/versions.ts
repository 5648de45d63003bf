/** Versions that people publish by hand, and moments that become graphs of their own. */

import { deleteGraph, type GraphSummary, importGraph, renameGraph, type Version } from "../graphs";
import { fetchJson, fetchText } from "../http";
import type { EditorApi } from "../schema/editor";

const below = (graph: string) => `/api/graphs/${encodeURIComponent(graph)}`;

export function publishNamed(graph: string, body: EditorApi["Publishing"]): Promise<Version> {
  return fetchJson(`${below(graph)}/versions`, { method: "POST", body });
}

/** A graph as it was after a change, as another one; edits of one do not touch the other. */
export async function copyMoment(graph: string, at: number, name: string): Promise<GraphSummary> {
  const made = await importGraph(await fetchText(`${below(graph)}/umrf?at=${at}`));
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
  return fetchJson(`/api/versions/${encodeURIComponent(id)}`, { signal });
}
