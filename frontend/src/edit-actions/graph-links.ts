/** Writes and reads addresses of a graph, of a thing in it (action, arrow, problem), and of a moment of its history. */

import { pageUrl } from "../api/page-url";
import { relationId } from "../graph/document-keys";
import type { Graph } from "../graph/model";
import type { PastPlace } from "./editor-context";

/** Returns the address of a graph, with the things to be shown. */
export function linkTo(
  graph: string,
  selection: readonly string[],
  page: string = pageUrl(),
): string {
  const url = new URL(`${page}/graphs/${encodeURIComponent(graph)}`);
  for (const id of selection.slice(0, 20)) {
    url.searchParams.append(id.includes(">") ? "arrow" : "action", id);
  }
  return url.href;
}

/** The address of a problem: what it is about, its code, and the field in which it is. */
export function linkToProblem(
  graph: string,
  problem: { readonly code: string; readonly where: { aid?: string; relation?: string } },
  field: string | null = null,
  page: string = pageUrl(),
): string {
  const place = problem.where.relation ?? problem.where.aid;
  const url = new URL(linkTo(graph, place === undefined ? [] : [place], page));
  url.searchParams.set("problem", problem.code);
  if (field !== null) url.searchParams.set("field", field);
  return url.href;
}

export interface LinkTarget {
  readonly selection: readonly string[];
  /** The panel of problems shall be open. */
  readonly problem: string | null;
  /** The field of it that shall have the keyboard: `in/grip/x`. */
  readonly field: string | null;
}

/** Returns the thing that an address points at; null when it names a graph only. */
export function targetOf(search: string): LinkTarget | null {
  const query = new URLSearchParams(search);
  const selection = [...query.getAll("action"), ...query.getAll("arrow")].slice(0, 20);
  const [problem, field] = [query.get("problem"), query.get("field")];
  return selection.length === 0 && problem === null ? null : { selection, problem, field };
}

/** Returns the keys of the selection that exist; an address may be older than a delete. */
export function present(graph: Graph, selection: readonly string[]): string[] {
  const known = new Set([
    ...graph.actions.map(({ key }) => key),
    ...graph.relations.map(relationId),
    ...graph.notes.map(([id]) => `g/${id}`),
    "entry",
    "exit",
  ]);
  return selection.filter((id) => known.has(id));
}

/** Returns true if an address asks for the history of the graph. */
export function asksForHistory(search: string): boolean {
  return new URLSearchParams(search).has("history");
}

/** Return the thread of the comment (`THREAD/MESSAGE`) that an address points at; null for none. */
export function commentIn(search: string): string | null {
  return new URLSearchParams(search).get("comment")?.split("/")[0] || null;
}

/** Return whether an address points at something within the graph, or asks for a panel. */
export const pointsInside = (search: string): boolean =>
  targetOf(search) !== null || commentIn(search) !== null || asksForHistory(search);

const SEQ = /^[1-9]\d{0,14}$/;
const RUN = /^run\/[\w-]{1,80}$/;

function comparedWith(text: string | null): PastPlace["with"] {
  if (text === "nothing" || text === "now" || text === "good") return text;
  if (text === null) return "own";
  if (RUN.test(text)) return text as `run/${string}`;
  return SEQ.test(text) ? Number(text) : "own";
}

/** Returns the moment or change that an address asks for; null where it asks for the present graph. */
export function pastOf(search: string): PastPlace | null {
  const query = new URLSearchParams(search);
  const at = query.get("at");
  if (at === null || !SEQ.test(at)) return null;
  return { at: Number(at), with: comparedWith(query.get("with")) };
}

/** The query with this moment in the place of the one that was there. */
export function withPast(search: string, place: PastPlace | null): string {
  const query = new URLSearchParams(search);
  query.delete("at");
  query.delete("with");
  if (place !== null) query.set("at", `${place.at}`);
  if (place !== null && place.with !== "own") query.set("with", `${place.with}`);
  const text = query.toString();
  return text === "" ? "" : `?${text}`;
}
