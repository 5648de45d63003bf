/** Offers to restore the moment on screen, or to make a new graph of it. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconCopyPlus, IconRestore } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link } from "wouter";
import { fetchGraphNames } from "../api/graph-names";
import { authorName, copyMoment, refreshGraphs, type Version } from "../api/graphs";
import { type HistoryEntry, refreshHistory, restoreMoment, revertEdits } from "../api/history";
import { errorText } from "../api/http";
import { pageUrl } from "../api/page-url";
import { usePerson } from "../api/people";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { withPast } from "../edit-actions/graph-links";
import { endsOf } from "../graph/document-keys";
import { copyNameOf } from "../graph/edit/clip";
import { notesOf } from "../graph/edit/notes";
import type { Graph } from "../graph/model";
import { endName } from "../graph/relation-words";
import { useRoom, useThrottledLink } from "../sync/use-room";
import { copyText } from "../ui/copy-text";
import { isolated } from "../words/isolated";
import { adoptEdit } from "./adopt-edit";
import style from "./restoring.module.css";

export function PastWays({ versions }: { versions: readonly Version[] }) {
  const context = useEditorContext();
  const { past, mayGoBack } = context;
  const { seq } = useThrottledLink();
  const { busy, restore } = useGoingBack(context);
  const copies = useCopyAsGraph();
  if (past === null || !mayGoBack) return null;
  const { at } = past;
  const index = versions.findIndex((each) => each.seq === at);
  const called = index < 0 ? `change ${at}` : `v${versions.length - index}`;
  return (
    <div className={`${style.ways} fingers`}>
      {at < seq && (
        <Button
          fullWidth
          variant="default"
          loading={busy}
          leftSection={<IconRestore size={15} aria-hidden />}
          onClick={() => void restore(at)}
        >
          Restore the graph
        </Button>
      )}
      <Button
        fullWidth
        variant="default"
        loading={copies.busy}
        leftSection={<IconCopyPlus size={15} aria-hidden />}
        onClick={() => void copies.copy(at, called)}
      >
        Copy {isolated(called)} as a new graph
      </Button>
      <p>Restoring is an edit like any other: nothing is lost, and you can undo it.</p>
    </div>
  );
}

/** Return the name of the action, arrow or note with a key of the document. */
function thingName(graph: Graph, key: string): string {
  const ends = endsOf(key);
  if (ends !== null)
    return `${isolated(endName(graph, ends.parent))} → ${isolated(endName(graph, ends.child))}`;
  if (!key.startsWith("g/")) return endName(graph, key);
  const text = notesOf(graph).find((note) => note.key === key)?.text ?? "";
  return text === "" ? "a note" : `“${text.slice(0, 40)}”`;
}

const MOST = 4; // things that are named

/** Return words for the parts that stayed as they are because other people changed them since. */
export function leftWords(graph: Graph, left: readonly string[]): string {
  if (left.length === 0) return "";
  const names = left.slice(0, MOST).map((key) => thingName(graph, key));
  const more = left.length > names.length ? ` and ${left.length - names.length} more` : "";
  return `Not undone, because others changed it or built on it since: ${names.map(isolated).join(", ")}${more}.`;
}

export function useGoingBack(context: EditorContext) {
  const client = useQueryClient();
  const { person } = usePerson();
  const opened = useRoom();
  const [busy, setBusy] = useState(false);
  const { id, graph, lookAt } = context;
  const go = async (refused: string, edit: () => Promise<void>, kind: HistoryEntry["kind"]) => {
    setBusy(true);
    const { seq } = opened.room.link();
    try {
      await edit();
      await adoptEdit(opened, id, { kind, author: person.id, after: seq }).catch((error: unknown) =>
        notifications.show({
          color: "red",
          title: `${kind === "restored" ? "Restored" : "Undone"}, but Ctrl Z cannot undo it. Use History.`,
          message: errorText(error),
        }),
      );
      lookAt(null);
    } catch (error) {
      notifications.show({ color: "red", title: refused, message: errorText(error) });
    } finally {
      setBusy(false);
      await refreshHistory(client, id);
    }
  };
  const revert = ({ author, from_seq = 0, seq }: HistoryEntry) =>
    go(
      "Not undone",
      async () => {
        const { left } = await revertEdits(id, { author: author.id, from_seq, seq });
        const message = leftWords(graph, left) || "Nobody had changed it since.";
        const title = `What ${isolated(authorName(author))} did is undone`;
        notifications.show({ title, message, autoClose: left.length > 0 ? 12_000 : 5_000 });
      },
      "reverted",
    );
  const restore = (seq: number, of?: string) =>
    go(
      "Not restored",
      async () => {
        await restoreMoment(id, seq, of);
      },
      "restored",
    );
  return { busy, revert, restore };
}

/** Copies a moment as a new graph, and says where that is. `called`: `v11`, or when it was. */
export function useCopyAsGraph() {
  const { id, graph } = useEditorContext();
  const client = useQueryClient();
  const [busy, setBusy] = useState(false);
  const copy = async (at: number, called: string) => {
    setBusy(true);
    try {
      const known = await fetchGraphNames(client);
      const name = copyNameOf(
        graph.name,
        called,
        known.map((each) => each.name),
      );
      const made = await copyMoment(id, at, name);
      notifications.show({
        title: "Copied as a new graph",
        message: <Link to={`/graphs/${made.id}`}>Open {isolated(made.name)}</Link>,
        autoClose: 15_000,
      });
    } catch (error) {
      notifications.show({ color: "red", title: "Not copied", message: errorText(error) });
    } finally {
      setBusy(false);
      await refreshGraphs(client);
    }
  };
  return { busy, copy };
}

/** The address of a graph as it was after a change. */
export function momentLink(id: string, at: number): string {
  const search = withPast("", { at, with: "own" });
  return `${pageUrl()}/graphs/${encodeURIComponent(id)}${search}`;
}

/** Copies a text and says that it did. */
export async function copied(text: string, what: string): Promise<void> {
  const done = await copyText(text);
  notifications.show(
    done
      ? { message: `${what} is copied`, autoClose: 3_000 }
      : { color: "red", title: "Not copied", message: text },
  );
}
