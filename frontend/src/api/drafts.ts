/** Drafts: what there is, what a merge would do, and doing it. */
import { type QueryClient, useQuery } from "@tanstack/react-query";
import { editor } from "./client";
import type { EditorApi } from "./schema/editor";

export type GraphDraft = EditorApi["DraftView"];
export type DraftProposal = EditorApi["DraftProposal"];
export type MergePreview = EditorApi["MergePreview"];
export type DraftConflict = EditorApi["DraftConflict"];
export type DraftSide = EditorApi["MergePreview"]["into"];
/** By the places of conflicts: whose value counts. */
export type DraftChoices = Readonly<Record<string, DraftSide>>;

const PERIOD = 8_000; // ms; what others do to the other side is no news of this room

const ofDraft = (id: string) => ({ draft_id: id });

/** Query the origin of a draft; null for a graph that is no draft. */
export function useDraftOf(id: string) {
  return useQuery({
    queryKey: ["drafts", "of", id],
    queryFn: async ({ signal }) => {
      const path = { graph_id: id };
      const found = await editor.get("/api/graphs/{graph_id}", { path, signal });
      return found.draft_of ?? null;
    },
    staleTime: Number.POSITIVE_INFINITY,
  });
}

/** A draft, beside the moment on screen; `seq` changes with it. */
export function useDraft(id: string, seq: number) {
  return useQuery({
    queryKey: ["drafts", "one", id, seq],
    queryFn: ({ signal }) => editor.get("/api/drafts/{draft_id}", { path: ofDraft(id), signal }),
    placeholderData: (before) => before,
    refetchInterval: PERIOD,
  });
}

/** The drafts of a graph, the last changed first. */
export function useDrafts(graph: string) {
  return useQuery({
    queryKey: ["drafts", "all", graph],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/{graph_id}/drafts", { path: { graph_id: graph }, signal }),
    refetchInterval: PERIOD,
  });
}

/** Query what a merge with these choices would do now. */
export function useMergePreview(id: string, into: DraftSide, choices: DraftChoices) {
  return useQuery({
    queryKey: ["drafts", "merge", id, into, choices],
    queryFn: ({ signal }) =>
      editor.post("/api/drafts/{draft_id}/preview", {
        path: ofDraft(id),
        body: { into, choices },
        signal,
      }),
    placeholderData: (before) => before,
    gcTime: 0,
  });
}

export function makeDraft(graph: string, body: EditorApi["NewDraft"]): Promise<GraphDraft> {
  return editor.post("/api/graphs/{graph_id}/drafts", { path: { graph_id: graph }, body });
}

/** Merge a draft and its origin, as one edit of the side that is merged into. Refused if either was changed since. */
export function mergeDraft(
  id: string,
  body: EditorApi["WantedMerge"],
): Promise<EditorApi["MergedDraft"]> {
  return editor.post("/api/drafts/{draft_id}/merge", { path: ofDraft(id), body });
}

export function proposeDraft(id: string, note: string): Promise<GraphDraft> {
  return editor.post("/api/drafts/{draft_id}/proposal", { path: ofDraft(id), body: { note } });
}

export function withdrawProposal(id: string): Promise<GraphDraft> {
  return editor.delete("/api/drafts/{draft_id}/proposal", { path: ofDraft(id) });
}

export function answerProposal(id: string, body: EditorApi["Answering"]): Promise<GraphDraft> {
  return editor.post("/api/drafts/{draft_id}/answers", { path: ofDraft(id), body });
}

export function refreshDrafts(client: QueryClient): Promise<void> {
  return client.invalidateQueries({
    predicate: ({ queryKey: [area, kind] }) => area === "drafts" && kind !== "of",
  });
}
