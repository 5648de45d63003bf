/** The graphs inside of a graph, by value: what goes along with starts, looks and expected courses. */
import { fetchJson } from "../http";
import type { Inside } from "../runs";
import type { EditorApi } from "../schema/editor";

interface Pinned {
  subgraphs?: readonly object[] | null | undefined;
  tree_digest?: string | null | undefined;
}

/** What a version, a run or a moment has inside, as it is sent. */
export function insideOf({ subgraphs, tree_digest }: Pinned): Inside {
  if (!subgraphs?.length || !tree_digest) return {};
  return { subgraphs, tree_digest };
}

/** What is inside of a moment, as it is now. */
export async function fetchInside(
  graph: string,
  seq: number,
  signal?: AbortSignal,
): Promise<Inside> {
  const route = `/api/graphs/${encodeURIComponent(graph)}/subgraphs?at=${seq}`;
  return insideOf(await fetchJson<EditorApi["InsideView"]>(route, { ...(signal && { signal }) }));
}
