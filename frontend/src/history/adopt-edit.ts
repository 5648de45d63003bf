/** Makes an edit that the server made for this person a step of their undo. */
import { fetchDocument, fetchHistory, type HistoryEntry } from "../api/history";
import { mapsFrom } from "../graph/document-keys";
import type { OpenRoom } from "../sync/open-room";

const NEWEST = 50; // entries of the history

interface ServerEdit {
  readonly kind: HistoryEntry["kind"];
  /** The id of the person. */
  readonly author: string;
  /** The edit is newer than this change. */
  readonly after: number;
}

/**
 * Adds the newest such edit of the person to their undo, once the page shows it. Adds nothing where the server had
 * nothing to change: its newest change is somebody else's then.
 */
export async function adoptEdit(
  { room, undo }: Pick<OpenRoom, "room" | "undo">,
  id: string,
  { kind, author, after }: ServerEdit,
): Promise<void> {
  const entries = await fetchHistory(id, NEWEST, null);
  const made = entries.find(
    (entry) => entry.kind === kind && entry.author.id === author && entry.seq > after,
  );
  if (made === undefined) return;
  const [before, then] = await Promise.all([
    fetchDocument(id, made.seq - 1),
    fetchDocument(id, made.seq),
    room.shows(made.seq),
  ]);
  undo.adopt(mapsFrom(before), mapsFrom(then));
}
