/** A moment of a graph as another graph, and as a link. */
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link } from "wouter";
import { copyMoment } from "../../api/documents/versions";
import { type GraphSummary, queryKeys, refreshGraphs } from "../../api/graphs";
import { errorText } from "../../api/http";
import { pageUrl } from "../../api/page-url";
import { useEditorContext } from "../../edit-actions/editor-context";
import { withPast } from "../../edit-actions/graph-links";
import { copyNameOf } from "../../graph/edit/clip";
import { copyText } from "../../ui/copy-text";
import { isolated } from "../../words/isolated";

/** Copies a moment as a new graph, and says where that is. `called`: `v11`, or when it was. */
export function useCopyAsGraph() {
  const { id, graph } = useEditorContext();
  const client = useQueryClient();
  const [busy, setBusy] = useState(false);
  const copy = async (at: number, called: string) => {
    setBusy(true);
    try {
      const known = client.getQueryData<GraphSummary[]>(queryKeys.graphs) ?? [];
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
