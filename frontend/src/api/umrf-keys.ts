/** UMRF text of any dialect as the keys that a document would hold. Nothing is stored. */
import { fetchJson } from "./http";
import type { EditorApi } from "./schema/editor";

export type UmrfKeys = EditorApi["Pieces"];

export function readUmrfKeys(text: string): Promise<UmrfKeys> {
  return fetchJson("/api/pieces", { method: "POST", body: text });
}
