/** Thumbnails of graphs by their digest. Those that are wanted at once are asked for in one request. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { editor } from "./client";
import { queryKeys } from "./graphs";
import type { EditorApi } from "./schema/editor";

export type Thumbnail = EditorApi["Thumbnail"];

const TOGETHER = 50; // ms in which cards come near the screen together
const MOST = 60; // of one request

interface Wanted {
  readonly name: string;
  readonly resolve: (thumbnail: Thumbnail | null) => void;
  readonly reject: (error: unknown) => void;
}

let waiting: Wanted[] = [];

async function ask(wanted: readonly Wanted[]): Promise<void> {
  // The browser keeps the answer by its address, so the same graphs make the same address.
  const names = [...new Set(wanted.map(({ name }) => name))].sort();
  const query = new URLSearchParams(names.map((name) => ["of", name]));
  try {
    const found = await editor.get("/api/graphs/thumbnails", { query });
    const byName = new Map(found.map((each) => [`${each.graph}.${each.digest}`, each.thumbnail]));
    for (const { name, resolve } of wanted) resolve(byName.get(name) ?? null);
  } catch (error) {
    for (const { reject } of wanted) reject(error);
  }
}

function askForAll(): void {
  const all = waiting;
  waiting = [];
  for (let from = 0; from < all.length; from += MOST) void ask(all.slice(from, from + MOST));
}

function fetchThumbnail(graph: string, digest: string): Promise<Thumbnail | null> {
  return new Promise((resolve, reject) => {
    if (waiting.length === 0) setTimeout(askForAll, TOGETHER);
    waiting.push({ name: `${graph}.${digest}`, resolve, reject });
  });
}

/** The thumbnail of a graph by the digest that the list shows; the last one until that has come. */
export function useThumbnail(graph: string, digest: string | undefined): Thumbnail | null {
  const found = useQuery({
    enabled: digest !== undefined,
    queryKey: [...queryKeys.thumbnail(graph), digest],
    queryFn: () => fetchThumbnail(graph, digest ?? ""),
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
    retry: false,
  });
  return found.data ?? null;
}
