/** Folders of graphs as the editor answers them, and the tree that they make. */
import { useQuery } from "@tanstack/react-query";
import { editor } from "./client";
import { type GraphSummary, queryKeys } from "./graphs";
import type { EditorApi } from "./schema/editor";

/** `graphs`: how many lie in it, without those in the folders inside of it. */
export type Folder = EditorApi["Folder"];

const inFolder = (id: string) => ({ folder_id: id });

export function useFolders() {
  return useQuery({
    queryKey: queryKeys.folders,
    queryFn: ({ signal }) => editor.get("/api/folders", { signal }),
    refetchInterval: 8_000,
  });
}

export function makeFolder(name: string, parent: string | null): Promise<Folder> {
  return editor.post("/api/folders", { body: { name, parent }, status: 201 });
}

export function renameFolder(id: string, name: string): Promise<Folder> {
  return editor.patch("/api/folders/{folder_id}", { path: inFolder(id), body: { name } });
}

/** Moves a folder with its contents into another one; null: out of all folders. */
export function moveFolder(id: string, parent: string | null): Promise<Folder> {
  return editor.put("/api/folders/{folder_id}/parent", { path: inFolder(id), body: { parent } });
}

/** Removes a folder. Its graphs and folders go into the folder around it. */
export function removeFolder(id: string): Promise<void> {
  return editor.delete("/api/folders/{folder_id}", { path: inFolder(id) });
}

/** Moves a graph into a folder; null: out of all folders. */
export function fileGraph(id: string, folder: string | null): Promise<GraphSummary> {
  return editor.put("/api/graphs/{graph_id}/folder", { path: { graph_id: id }, body: { folder } });
}

/** Return a folder and those around it, the outermost first; none for an id that is unknown. */
export function folderWay(folders: readonly Folder[], id: string | null | undefined): Folder[] {
  const known = new Map(folders.map((folder) => [folder.id, folder]));
  const way: Folder[] = [];
  for (let at = known.get(id ?? ""); at && !way.includes(at); at = known.get(at.parent ?? "")) {
    way.unshift(at);
  }
  return way;
}

/** Return the ids of a folder and of all folders inside of it. */
export function foldersWithin(folders: readonly Folder[], id: string): ReadonlySet<string> {
  const inside = folders.filter((folder) => folderWay(folders, folder.id).some((f) => f.id === id));
  return new Set(inside.map((folder) => folder.id));
}

/** Return all folders, each before those inside of it, with how many are around it. */
export function foldersInOrder(
  folders: readonly Folder[],
  parent: string | null = null,
  depth = 0,
): { folder: Folder; depth: number }[] {
  const here = folders.filter((folder) => (folder.parent ?? null) === parent);
  return here.flatMap((folder) => [
    { folder, depth },
    ...foldersInOrder(folders, folder.id, depth + 1),
  ]);
}

/** Return the names on the way to a folder in words; "" for an id that is unknown. */
export function folderPath(folders: readonly Folder[], id: string | null | undefined): string {
  return folderWay(folders, id)
    .map(({ name }) => name)
    .join(" / ");
}

/** Return the address of the first page with a folder; without one with the graphs that are in none. */
export const placeOfFolder = (id: string | null | undefined) => (id ? `/?folder=${id}` : "/");
