/** Takes files in: graphs as graphs, actions into the library, each looked at first where it was translated. */
import { importAction, previewAction, replaceAction } from "../../api/documents/library";
import { refusedAt } from "../../api/documents/refused-at";
import { previewGraph } from "../../api/documents/texts";
import { type GraphSummary, importGraph, type Preview } from "../../api/graphs";
import { errorPlace, errorText } from "../../api/http";
import { isPlain, isPlainAction } from "./dialects";
import { importReviews } from "./import-review";

const MOST_BYTES = 10 * 1024 * 1024;

interface TakenFile {
  readonly kind: "graph" | "action";
  readonly made: GraphSummary;
}

/** An action that the library has already: its document, and what the file says of it. */
export interface KnownFile {
  readonly file: string;
  readonly document: string;
  readonly text: string;
}

export interface TakenFiles {
  readonly taken: readonly TakenFile[];
  readonly known: readonly KnownFile[];
  /** File by file why it was not taken. */
  readonly failed: readonly string[];
}

function wordsOfFailure(file: string, error: unknown): string {
  const where = errorPlace(error);
  return `${file}: ${errorText(error)}${where === "" ? "" : ` (${where})`}`;
}

/** What a file would become; the library looks at what is no graph. */
async function previewOf(text: string): Promise<{ kind: TakenFile["kind"]; preview: Preview }> {
  try {
    return { kind: "graph", preview: await previewGraph(text) };
  } catch (error) {
    if (refusedAt(error, "code") !== "action-file") throw error;
    return { kind: "action", preview: await previewAction(text) };
  }
}

/** Null: somebody did not want it. */
async function take(file: File): Promise<TakenFile | KnownFile | null> {
  if (file.size > MOST_BYTES) throw new Error("The file is larger than 10 MB.");
  const text = await file.text();
  const { kind, preview } = await previewOf(text);
  const plain = kind === "graph" ? isPlain(preview) : isPlainAction(preview);
  if (!plain && !(await importReviews.ask(file.name, preview))) return null;
  if (kind === "graph") return { kind, made: await importGraph(text) };
  try {
    return { kind, made: await importAction(text) };
  } catch (error) {
    const document = refusedAt(error, "graph");
    if (document === "") throw error;
    return { file: file.name, document, text };
  }
}

/** One after the other; `tell` hears how many are done. */
export async function takeFiles(
  files: readonly File[],
  tell: (done: number) => void,
): Promise<TakenFiles> {
  const taken: TakenFile[] = [];
  const known: KnownFile[] = [];
  const failed: string[] = [];
  for (const [i, file] of files.entries()) {
    tell(i);
    try {
      const found = await take(file);
      if (found !== null && "made" in found) taken.push(found);
      else if (found !== null) known.push(found);
    } catch (error) {
      failed.push(wordsOfFailure(file.name, error));
    }
  }
  return { taken, known, failed };
}

/** Makes actions of the library what their files say; answers what went wrong. */
export async function replaceKnown(known: readonly KnownFile[]): Promise<string[]> {
  const failed: string[] = [];
  for (const { file, document, text } of known) {
    try {
      await replaceAction(document, text);
    } catch (error) {
      failed.push(wordsOfFailure(file, error));
    }
  }
  return failed;
}
