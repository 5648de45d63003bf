/** Drafts: what there is, what a merge would do, and doing it. */
import { type QueryClient, useQuery } from "@tanstack/react-query";
import type { GraphSummary } from "./graphs";
import { fetchJson } from "./http";
import type { EditorApi } from "./schema/editor";

export type GraphDraft = EditorApi["DraftView"];
export type DraftProposal = EditorApi["DraftProposal"];
export type MergePreview = EditorApi["MergePreview"];
export type DraftConflict = EditorApi["DraftConflict"];
export type DraftSide = EditorApi["MergePreview"]["into"];
/** By the places of conflicts: whose value counts. */
export type DraftChoices = Readonly<Record<string, DraftSide>>;

const PERIOD = 8_000; // ms; what others do to the other side is no news of this room

const below = (id: string) => `/api/drafts/${encodeURIComponent(id)}`;
const under = (graph: string) => `/api/graphs/${encodeURIComponent(graph)}/drafts`;

/** Query the origin of a draft; null for a graph that is no draft. */
export function useDraftOf(id: string) {
  return useQuery({
    queryKey: ["drafts", "of", id],
    queryFn: async ({ signal }) => {
      const found = await fetchJson<GraphSummary>(`/api/graphs/${encodeURIComponent(id)}`, {
        signal,
      });
      return found.draft_of ?? null;
    },
    staleTime: Number.POSITIVE_INFINITY,
  });
}

/** A draft, beside the moment on screen; `seq` changes with it. */
export function useDraft(id: string, seq: number) {
  return useQuery({
    queryKey: ["drafts", "one", id, seq],
    queryFn: ({ signal }) => fetchJson<GraphDraft>(below(id), { signal }),
    placeholderData: (before) => before,
    refetchInterval: PERIOD,
  });
}

/** The drafts of a graph, the last changed first. */
export function useDrafts(graph: string) {
  return useQuery({
    queryKey: ["drafts", "all", graph],
    queryFn: ({ signal }) => fetchJson<GraphDraft[]>(under(graph), { signal }),
    refetchInterval: PERIOD,
  });
}

/** Query what a merge with these choices would do now. */
export function useMergePreview(id: string, into: DraftSide, choices: DraftChoices) {
  return useQuery({
    queryKey: ["drafts", "merge", id, into, choices],
    queryFn: ({ signal }) =>
      fetchJson<MergePreview>(`${below(id)}/preview`, {
        method: "POST",
        body: { into, choices },
        signal,
      }),
    placeholderData: (before) => before,
    gcTime: 0,
  });
}

export function makeDraft(graph: string, body: EditorApi["NewDraft"]): Promise<GraphDraft> {
  return fetchJson(under(graph), { method: "POST", body });
}

/** One edit of the side that is merged into; refused where either was changed since. */
export function mergeDraft(
  id: string,
  body: EditorApi["WantedMerge"],
): Promise<EditorApi["MergedDraft"]> {
  return fetchJson(`${below(id)}/merge`, { method: "POST", body });
}

export function proposeDraft(id: string, note: string): Promise<GraphDraft> {
  return fetchJson(`${below(id)}/proposal`, { method: "POST", body: { note } });
}

export function withdrawProposal(id: string): Promise<GraphDraft> {
  return fetchJson(`${below(id)}/proposal`, { method: "DELETE" });
}

export function answerProposal(id: string, body: EditorApi["Answering"]): Promise<GraphDraft> {
  return fetchJson(`${below(id)}/answers`, { method: "POST", body });
}

export function refreshDrafts(client: QueryClient): Promise<void> {
  return client.invalidateQueries({
    predicate: ({ queryKey: [area, kind] }) => area === "drafts" && kind !== "of",
  });
}
