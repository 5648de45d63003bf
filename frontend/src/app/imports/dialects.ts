/** In which form a file is written, and whether there is anything to look at before it is kept. Pure. */
import type { Preview } from "../../api/graphs";

/** Nothing was translated and nothing is without a place: there is nothing to look at. */
export function isPlain({ dialect, notes }: Preview): boolean {
  return dialect === "D3" && notes.length === 0;
}

/** The same of the file of one action. */
export function isPlainAction({ dialect, notes }: Preview): boolean {
  return dialect === "D3-action" && notes.length === 0;
}

const DIALECTS: Readonly<Record<string, string>> = {
  D0: "a single action",
  "D3-action": "a single action",
  D1: "the first form of graphs (umrf_actions)",
  "D1'": "a shallow graph of the first form",
  D2: "an earlier form of graphs (condition, numbers as states)",
  D3: "the engine’s present form",
  "D3-designer": "the form of the old designer",
};

export function dialectWords(dialect: string): string {
  return DIALECTS[dialect] ?? "another form";
}
