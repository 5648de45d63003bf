/** Texts of graphs: what a file would become, the text of a moment, and what an edited one would change. */
import type { Preview } from "../graphs";
import { fetchAnswer, fetchJson } from "../http";
import type { EditorApi } from "../schema/editor";

export function previewGraph(text: string): Promise<Preview> {
  return fetchJson("/api/graphs?preview=true", { method: "POST", body: text });
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
/** What an edited text would change, and the errors that would come with it. */
export type TextChanges = EditorApi["TextEdit"];

/** What the text, edited from that of the moment `seq`, would change. Nothing is stored. */
export function textChangesOf(id: string, seq: number, text: string): Promise<TextChanges> {
  const route = `/api/graphs/${encodeURIComponent(id)}/rewriting?seq=${seq}`;
  return fetchJson(route, { method: "POST", body: text });
}
