/** Links that show one graph or run to people without a name, as owners see them. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, renewing, runnerAt } from "./client";
import type { EditorApi } from "./schema/editor";
import { runnerOfRun } from "./site-places";

export type ViewLink = EditorApi["ViewLink"];

/** A thing that a link can show. Links of graphs are the editor's, those of runs the runner's. */
export interface ViewedThing {
  readonly kind: "graph" | "run";
  readonly id: string;
}

const KEY = "view-links";
const LOOK = 4_000; // ms: who opens a link is counted soon

/** Return the client of the process that has the links of a thing: both have the same routes. */
const processOf = ({ kind, id }: ViewedThing, runner: string | undefined) =>
  runnerAt(kind === "graph" || runner === undefined ? "" : runnerOfRun(runner, id));

export function useViewLinks(runner: string | undefined, thing: ViewedThing) {
  return useQuery({
    queryKey: [KEY, thing.kind, thing.id],
    queryFn: ({ signal }) =>
      processOf(thing, runner).get("/api/view-links", { query: { thing: thing.id }, signal }),
    enabled: thing.kind === "graph" || runner !== undefined,
    refetchInterval: LOOK,
  });
}

export function useMakeViewLink(runner: string | undefined, thing: ViewedThing) {
  const client = useQueryClient();
  return useMutation({
    mutationFn: (more: { label: string; days: number }) =>
      processOf(thing, runner).post("/api/view-links", { body: { thing: thing.id, ...more } }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: [KEY] })),
  });
}

export function useRevokeViewLink(runner: string | undefined, thing: ViewedThing) {
  const client = useQueryClient();
  return useMutation({
    mutationFn: (link: string) =>
      processOf(thing, runner).post("/api/view-links/{link}/revoke", { path: { link } }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: [KEY] })),
  });
}

/** Return the origins of sites that may show links in a frame, as the setting of the server says. */
export function useFrameOrigins() {
  return useQuery({
    queryKey: [KEY, "places"],
    queryFn: ({ signal }) => editor.get("/api/view", { signal }),
    select: ({ frame_origins }) => frame_origins,
    staleTime: Number.POSITIVE_INFINITY,
  });
}
