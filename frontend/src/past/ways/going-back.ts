/** The ways back from the past: an edit that everybody sees, and what is said of it. */
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import {
  type HistoryEntry,
  refreshHistory,
  restoreMoment,
  revertEdits,
} from "../../api/documents/history";
import { authorName } from "../../api/graphs";
import { errorText } from "../../api/http";
import type { EditorContext } from "../../edit-actions/editor-context";
import { endsOf } from "../../graph/document-keys";
import { notesOf } from "../../graph/edit/notes";
import type { Graph } from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { isolated } from "../../words/isolated";

/** What a key of the document is called: an action, an arrow, a note. */
function thingName(graph: Graph, key: string): string {
  const ends = endsOf(key);
  if (ends !== null)
    return `${isolated(endName(graph, ends.parent))} → ${isolated(endName(graph, ends.child))}`;
  if (!key.startsWith("g/")) return endName(graph, key);
  const text = notesOf(graph).find((note) => note.key === key)?.text ?? "";
  return text === "" ? "a note" : `“${text.slice(0, 40)}”`;
}

const MOST = 4; // things that are named

/** What was left as it is, since others have set it since. */
export function leftWords(graph: Graph, left: readonly string[]): string {
  if (left.length === 0) return "";
  const names = left.slice(0, MOST).map((key) => thingName(graph, key));
  const more = left.length > names.length ? ` and ${left.length - names.length} more` : "";
  return `Left as it is, since others changed it or built on it: ${names.map(isolated).join(", ")}${more}.`;
}

export function useGoingBack(context: EditorContext) {
  const client = useQueryClient();
  const [busy, setBusy] = useState(false);
  const { id, graph, lookAt } = context;
  const go = async (refused: string, edit: () => Promise<void>) => {
    setBusy(true);
    try {
      await edit();
      lookAt(null);
    } catch (error) {
      notifications.show({ color: "red", title: refused, message: errorText(error) });
    } finally {
      setBusy(false);
      await refreshHistory(client, id);
    }
  };
  const revert = ({ author, from_seq = 0, seq }: HistoryEntry) =>
    go("Not undone", async () => {
      const { left } = await revertEdits(id, { author: author.id, from_seq, seq });
      const message = leftWords(graph, left) || "Nobody had changed it since.";
      const title = `What ${isolated(authorName(author))} did is undone`;
      notifications.show({ title, message, autoClose: left.length > 0 ? 12_000 : 5_000 });
    });
  const restore = (seq: number, of?: string) =>
    go("Not restored", async () => {
      await restoreMoment(id, seq, of);
    });
  return { busy, revert, restore };
}
