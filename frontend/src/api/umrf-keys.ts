/** UMRF text of any dialect as the keys that a document would hold. Nothing is stored. */
import { fetchJson } from "./http";

export interface UmrfKeys {
  readonly dialect: string;
  readonly notes: readonly string[];
  readonly name: string;
  readonly actions: Readonly<Record<string, unknown>>;
  readonly relations: Readonly<Record<string, unknown>>;
  readonly positions: Readonly<Record<string, unknown>>;
}

export function readUmrfKeys(text: string): Promise<UmrfKeys> {
  return fetchJson("/api/pieces", { method: "POST", body: text });
}
