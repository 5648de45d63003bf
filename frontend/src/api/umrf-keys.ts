/** UMRF text of any dialect as the keys that a document would hold. Nothing is stored. */
import { ask } from "./http";

export interface Pieces {
  readonly dialect: string;
  readonly notes: readonly string[];
  readonly name: string;
  readonly actions: Readonly<Record<string, unknown>>;
  readonly relations: Readonly<Record<string, unknown>>;
  readonly positions: Readonly<Record<string, unknown>>;
}

export function readPieces(text: string): Promise<Pieces> {
  return ask("/api/pieces", { method: "POST", body: text });
}
