/** The moment of the past in the address of a graph: `?at=12`, `?at=12&with=now`. Pure. */
import type { PastPlace } from "./editor-context";

const SEQ = /^[1-9]\d{0,14}$/;
const RUN = /^run\/[\w-]{1,80}$/;

function comparedWith(text: string | null): PastPlace["with"] {
  if (text === "nothing" || text === "now" || text === "good") return text;
  if (text === null) return "own";
  if (RUN.test(text)) return text as `run/${string}`;
  return SEQ.test(text) ? Number(text) : "own";
}

/** What an address asks for; null where it asks for the graph as it is. */
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
