/**
 * The clipboard: UMRF text for everybody, and beside it the exact pieces for our own pages.
 *
 * A key press gives a page the system's clipboard on any address. A menu may have it only in a
 * secure context; elsewhere what was copied last in this browser serves.
 */
import { notifications } from "@mantine/notifications";
import { readUmrfKeys } from "../api/graphs";
import { errorText } from "../api/http";
import { errorPlace } from "../api/refusal-places";
import { arrange, isUnplaced, positionsOf } from "../canvas/geometry/arrange";
import { mapsFrom } from "../graph/document-keys";
import { type Clip, clipOf, isEmpty, paste } from "../graph/edit/clip";
import { readGraph } from "../graph/read";
import { umrfText } from "../graph/umrf-text";
import { copyText } from "../ui/copy-text";
import { type EditorContext, selectedActions } from "./editor-context";
import { freshPlaces } from "./layout";

export interface CopiedContent {
  /** The text that was given to the system's clipboard. */
  readonly text: string;
  readonly clip: Clip;
}

const STORAGE_KEY = "aa.clipboard";
const MOST = 2_000_000; // characters that are kept for other tabs
let latest: CopiedContent | null = null;

/** Returns the selection for the clipboard. Notes alone are copied as their own text. */
export function copiedSelection(context: EditorContext): CopiedContent {
  const places = context.positions();
  const clip = clipOf(context.doc, context.selection, places);
  const actions = selectedActions(context).filter(({ missing }) => !missing);
  if (actions.length === 0) return { text: JSON.stringify(clip.positions), clip };
  const keys = new Set(actions.map(({ key }) => key));
  return { text: umrfText(context.graph, keys, places), clip };
}

/** Remembers it for this browser's pages. */
export function rememberCopied(held: CopiedContent): void {
  latest = held;
  try {
    const text = JSON.stringify(held);
    if (text.length <= MOST) localStorage.setItem(STORAGE_KEY, text);
    else localStorage.removeItem(STORAGE_KEY);
  } catch {
    // A browser that keeps nothing still has it on this page.
  }
}

/** Another version of this page may have left something else. */
function isHeld(value: unknown): value is CopiedContent {
  if (typeof value !== "object" || value === null) return false;
  const { text, clip } = value as { text?: unknown; clip?: Partial<Record<keyof Clip, unknown>> };
  const maps = [clip?.actions, clip?.relations, clip?.positions];
  return typeof text === "string" && maps.every((map) => typeof map === "object" && map !== null);
}

/** Returns what was copied last in this browser. */
function lastCopied(): CopiedContent | null {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(STORAGE_KEY) ?? "null");
    if (isHeld(kept)) return kept;
  } catch {
    // as above
  }
  return latest;
}

/** Copies an address, or shows it where the browser does not let us. */
export async function copyLinkTo(link: string): Promise<void> {
  notifications.show(
    (await copyText(link))
      ? { message: "Link copied" }
      : { title: "The browser did not copy the link", message: link, autoClose: 20_000 },
  );
}

/** The system's clipboard where it may be read, else what was copied last in this browser. */
export async function readText(): Promise<string> {
  try {
    if (window.isSecureContext) return await navigator.clipboard.readText();
  } catch {
    // no permission
  }
  return lastCopied()?.text ?? "";
}

function failed(message: string): void {
  notifications.show({ color: "red", title: "Nothing pasted", message, autoClose: 12_000 });
}

/** Returns the clip with places for things that have none: files often come without. */
async function placed(context: EditorContext, clip: Clip): Promise<Clip> {
  const graph = { ...readGraph(mapsFrom(clip)), direction: context.graph.direction };
  if (graph.actions.every(({ position }) => position !== null)) return clip;
  const places = isUnplaced(graph)
    ? ((await freshPlaces(graph)) ?? arrange(graph))
    : positionsOf(graph);
  return { ...clip, positions: { ...Object.fromEntries(places), ...clip.positions } };
}

async function land(context: EditorContext, clip: Clip, own: boolean): Promise<void> {
  // The pointer is read now, since laying out takes a moment.
  const pointer = context.view.pointer();
  const pieces = await placed(context, clip);
  const keys = paste(
    context.doc,
    pieces,
    pointer ? { at: pointer.at } : own ? { by: [40, 40] } : { at: context.view.middle() },
  );
  context.select(keys);
  requestAnimationFrame(() => {
    const [first] = keys;
    const at = first === undefined ? undefined : context.positions().get(first);
    if (at) context.view.reveal(at);
    if (first !== undefined) context.view.focus(first);
  });
}

/** Adds what a text holds: our own pieces exactly, any UMRF as the server reads it. */
export async function pasteText(context: EditorContext, text: string): Promise<void> {
  const ours = lastCopied();
  if (ours !== null && ours.text === text && !isEmpty(ours.clip)) {
    // In the graph it came from, the copy would lie on the original.
    const same = Object.keys(ours.clip.actions).some((key) =>
      context.graph.actions.some((action) => action.key === key),
    );
    await land(context, ours.clip, same);
    return;
  }
  if (text.trim() === "") {
    failed("The clipboard has no text. Copy actions here, or UMRF text anywhere.");
    return;
  }
  try {
    const pieces = await readUmrfKeys(text);
    if (isEmpty(pieces)) failed("This UMRF text has no actions.");
    else await land(context, pieces, false);
  } catch (error) {
    const where = errorPlace(error);
    failed(where === "" ? errorText(error) : `${errorText(error)} (${where})`);
  }
}
