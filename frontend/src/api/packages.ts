/** C++ packages of a graph's actions, as the editor answers them. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { editor } from "./client";
import { serverPath } from "./page-url";
import type { EditorApi } from "./schema/editor";

export type PackageList = EditorApi["PackageList"];
export type PackageOutline = EditorApi["PackageOutline"];
export type PackageRefusal = EditorApi["PackageRefusal"];

const listPackages = (graph: string, signal: AbortSignal) =>
  editor.get("/api/graphs/{graph_id}/packages", { path: { graph_id: graph }, signal });

/** The packages that the graph has now, and why some actions have none. */
export function usePackages(graph: string) {
  return useQuery({
    queryKey: ["packages", graph],
    queryFn: ({ signal }) => listPackages(graph, signal),
    // Once opened it stays the packages of one moment, and what is downloaded is what was seen.
    staleTime: 0,
    gcTime: 0,
    refetchOnWindowFocus: false,
    refetchOnReconnect: false,
  });
}

/** Query the packages while the document is edited: `seq` is the moment on screen, from 1 on. */
export function usePackagesAt(graph: string, seq: number) {
  return useQuery({
    enabled: seq > 0,
    queryKey: ["packages", graph, "now", seq],
    queryFn: ({ signal }) => listPackages(graph, signal),
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 60_000,
  });
}

/** The files of one package, as the graph was after its change `seq`. */
export function usePackage(graph: string, seq: number, name: string) {
  return useQuery({
    queryKey: ["packages", graph, seq, name],
    queryFn: ({ signal }) =>
      editor.get("/api/graphs/{graph_id}/packages/{package}", {
        path: { graph_id: graph, package: name },
        query: { at: seq },
        signal,
      }),
    staleTime: Number.POSITIVE_INFINITY,
  });
}

/** Return the address from which the browser downloads one package, or all of them. */
export function packageDownload(graph: string, seq: number, name?: string): string {
  const one = name === undefined ? "" : `&package=${encodeURIComponent(name)}`;
  return serverPath(`/api/graphs/${encodeURIComponent(graph)}/packages.zip?at=${seq}${one}`);
}
