/** Takes files in: graphs as graphs, actions into the library, each looked at first where it was translated. */

import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { type GraphSummary, importGraph, type Preview, previewGraph } from "../../api/graphs";
import { errorText } from "../../api/http";
import { importAction, previewAction, replaceAction } from "../../api/library";
import { errorPlace, refusedAt } from "../../api/refusal-places";
import { tick } from "../../clock/server-clock";
import { importReviews } from "./import-review";

const MOST_BYTES = 10 * 1024 * 1024;

interface TakenFile {
  readonly kind: "graph" | "action";
  readonly made: GraphSummary;
}

/** An action that the library has already: its document, and what the file says of it. */
interface KnownFile {
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

/**
 * Return what a file would become. Files that are no graph are read as an action of the library.
 */
async function previewOf(text: string): Promise<{ kind: TakenFile["kind"]; preview: Preview }> {
  try {
    return { kind: "graph", preview: await previewGraph(text) };
  } catch (error) {
    if (refusedAt(error, "code") !== "action-file") throw error;
    return { kind: "action", preview: await previewAction(text) };
  }
}

/** Null: somebody did not want it. */
async function take(file: File, folder: string | null): Promise<TakenFile | KnownFile | null> {
  if (file.size > MOST_BYTES) throw new Error("The file is larger than 10 MB.");
  const text = await file.text();
  const { kind, preview } = await previewOf(text);
  const plain = kind === "graph" ? isPlain(preview) : isPlainAction(preview);
  if (!plain && !(await importReviews.ask(file.name, preview))) return null;
  if (kind === "graph") return { kind, made: await importGraph(text, folder) };
  try {
    return { kind, made: await importAction(text) };
  } catch (error) {
    const document = refusedAt(error, "graph");
    if (document === "") throw error;
    return { file: file.name, document, text };
  }
}

/** Imports files one after the other; `tell` is called with how many are done. Returns what came of each. */
export async function takeFiles(
  files: readonly File[],
  tell: (done: number) => void,
  folder: string | null = null,
): Promise<TakenFiles> {
  const taken: TakenFile[] = [];
  const known: KnownFile[] = [];
  const failed: string[] = [];
  for (const [i, file] of files.entries()) {
    tell(i);
    try {
      const found = await take(file, folder);
      if (found !== null && "made" in found) taken.push(found);
      else if (found !== null) known.push(found);
    } catch (error) {
      failed.push(wordsOfFailure(file.name, error));
    }
  }
  return { taken, known, failed };
}

/** Makes actions of the library what their files say; answers what went wrong. */
async function replaceKnown(known: readonly KnownFile[]): Promise<string[]> {
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

const MOST_TOLD = 5;
const PROGRESS = "files-taken";

/**
 * Returns the notice of an import of `count` files: `tell` shows how many are done, `end` hides it. It appears
 * after 0.7 s, since a few files are taken before anybody could read it.
 */
export function progressOf(count: number): { tell: (done: number) => void; end: () => void } {
  let shown = false;
  const start = tick();
  const tell = (done: number) => {
    const message = `${done} of ${count} files`;
    if (shown) notifications.update({ id: PROGRESS, message, loading: true, autoClose: false });
    else if (tick() - start > 700) {
      shown = true;
      notifications.show({
        id: PROGRESS,
        title: "Importing",
        message,
        loading: true,
        autoClose: false,
        withCloseButton: false,
      });
    }
  };
  return { tell, end: () => shown && notifications.hide(PROGRESS) };
}

function complain(failed: readonly string[]): void {
  if (failed.length === 0) return;
  const more = failed.length - MOST_TOLD;
  notifications.show({
    color: "red",
    title: failed.length === 1 ? "A file was not imported" : `${failed.length} files were not`,
    message: [...failed.slice(0, MOST_TOLD), ...(more > 0 ? [`and ${more} more`] : [])].join("\n"),
    autoClose: 15_000,
    style: { whiteSpace: "pre-line" },
  });
}

/**
 * Offers to replace the graphs that came from these files. People are asked, since others may have edited them;
 * the history leads back.
 */
function offerReplacing(known: readonly KnownFile[], after: () => void): void {
  if (known.length === 0) return;
  const id = `known-${known.map(({ document }) => document).join(" ")}`;
  const replace = async () => {
    notifications.hide(id);
    complain(await replaceKnown(known));
    after();
  };
  notifications.show({
    id,
    title:
      known.length === 1
        ? `The library has the action of ${known[0]?.file} already`
        : `The library has ${known.length} of these actions already`,
    message: (
      <Button size="compact-sm" mt="xs" onClick={() => void replace()}>
        Replace them by the files
      </Button>
    ),
    autoClose: false,
  });
}

/** Shows what came of an import, and offers to replace known graphs. `after` is called once they are replaced. */
export function tellTaken({ taken, known, failed }: TakenFiles, after: () => void): void {
  complain(failed);
  offerReplacing(known, after);
  const actions = taken.filter(({ kind }) => kind === "action").length;
  if (actions > 1) {
    notifications.show({ message: `${actions} actions are in the library now.` });
  }
}

/**
 * Return the page to open after an import: the newest graph or action, or the list if several
 * actions came; null for none.
 */
export function placeAfter({ taken, known }: Pick<TakenFiles, "taken" | "known">): string | null {
  const last = taken.at(-1);
  if (last === undefined) {
    return known.length === 1 ? `/actions/${known[0]?.document}` : null;
  }
  if (last.kind === "graph") return `/graphs/${last.made.id}`;
  return taken.length === 1 ? `/actions/${last.made.id}` : "/actions";
}

/** Return whether a graph file needs no review: it has today's dialect, and no notes. */
export function isPlain({ dialect, notes }: Preview): boolean {
  return dialect === "D3" && notes.length === 0;
}

/** Return whether the file of an action needs no review. */
function isPlainAction({ dialect, notes }: Preview): boolean {
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
