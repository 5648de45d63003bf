/** Changes as a file that people and programs can read, saved by the browser. */

import { changesOf, type GraphChange } from "../graph/changes";
import { type Maps, mapsFrom } from "../graph/document-keys";
import type { StrandedEdits } from "../sync/replaced-history";

interface ChangesFile {
  readonly graph: string;
  readonly made_by: string;
  /** When the last of them was made. */
  readonly made_at: string;
  readonly changes: readonly {
    readonly what: string;
    readonly values: readonly { field: string; before: string | null; after: string | null }[];
  }[];
  /** The whole graph with these changes, by key, as the shared document has it. */
  readonly document: { readonly [root: string]: Readonly<Record<string, unknown>> };
}

/** In one line: "changed action Look". */
export function changeSentence({ kind, thing, title }: GraphChange): string {
  return thing === "graph" ? `${kind} the graph` : `${kind} ${thing} ${title}`;
}

function fileOf(graph: string, by: string, stranded: StrandedEdits): ChangesFile {
  const changes = changesOf(stranded, mapsFrom({})).map((change) => ({
    what: changeSentence(change),
    values: change.lines.map(({ field, before, after }) => ({ field, before, after })),
  }));
  const made_at = new Date(stranded.at).toISOString();
  return { graph, made_by: by, made_at, changes, document: plain(stranded.here) };
}

/** Saves them where the browser saves files. */
export function saveChanges(graph: string, by: string, all: readonly StrandedEdits[]): void {
  const content = all.map((stranded) => fileOf(graph, by, stranded));
  const text = JSON.stringify(content.length === 1 ? content[0] : content, null, 2);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  link.download = `${graph || "graph"} - changes of ${by || "a guest"}.json`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

function plain(maps: Maps): ChangesFile["document"] {
  return Object.fromEntries(
    Object.entries(maps).map(([root, map]) => [root, Object.fromEntries(map)]),
  );
}
