/** Graphs, or actions of the library, that were deleted: when, how large, and the way back. */
import { Button, Modal, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconRestore } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import {
  type GraphSummary,
  recoverGraph,
  refreshGraphs,
  refreshLibrary,
  useDeletedGraphs,
} from "../api/graphs";
import { errorText } from "../api/http";
import { useDeletedActions } from "../api/library";
import { useMay } from "../api/people";
import { ago, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./deleted-graphs-dialog.module.css";

/** The last deleted first: what one looks for is mostly what has just gone. */
function byDeletion(graphs: readonly GraphSummary[]): GraphSummary[] {
  const at = ({ deleted_at }: GraphSummary) => instant(deleted_at ?? null) ?? 0;
  return [...graphs].sort((a, b) => at(b) - at(a));
}

const actionsOf = ({ actions = 0 }: GraphSummary) => counted(actions, "action");

type Kind = "graph" | "action";

function Row({ graph, kind, now }: { graph: GraphSummary; kind: Kind; now: number }) {
  const client = useQueryClient();
  const mayEdit = useMay("edit");
  const at = instant(graph.deleted_at ?? null);
  const bringBack = useMutation({
    mutationFn: () => recoverGraph(graph.id),
    onError: (error) =>
      notifications.show({ color: "red", title: "Not brought back", message: errorText(error) }),
    onSettled: () => Promise.all([refreshGraphs(client), refreshLibrary(client)]),
  });
  return (
    <li className={style.row}>
      <span className="fill">
        <bdi className="block truncate weight-600">
          {graph.name || "Untitled"}
          {graph.draft_of && `, draft “${isolated(graph.draft_of.name)}”`}
        </bdi>
        <span className="quiet-12">
          {[
            ...(kind === "graph" ? [actionsOf(graph)] : []),
            ...(at === null ? [] : [`deleted ${ago(at, now)}`]),
          ].join(" · ")}
        </span>
      </span>
      {mayEdit && (
        <Button
          leftSection={<IconRestore size={15} aria-hidden />}
          disabled={bringBack.isPending}
          onClick={() => bringBack.mutate()}
        >
          Bring back<span className="visually-hidden"> {graph.name || "Untitled"}</span>
        </Button>
      )}
    </li>
  );
}

function List({ kind }: { kind: Kind }) {
  const now = useNow(20_000);
  const deletedGraphs = useDeletedGraphs(kind === "graph");
  const deletedActions = useDeletedActions(kind === "action");
  const deleted = kind === "graph" ? deletedGraphs : deletedActions;
  const graphs = byDeletion(deleted.data ?? []);
  if (deleted.isPending) return <Skeleton height={40} />;
  if (deleted.isError) return <p role="alert">{errorText(deleted.error)}</p>;
  if (graphs.length === 0) return <p className="quiet-12">Nothing is deleted.</p>;
  return (
    <ul className="list-reset">
      {graphs.map((graph) => (
        <Row key={graph.id} graph={graph} kind={kind} now={now} />
      ))}
    </ul>
  );
}

interface Props {
  kind: Kind;
  opened: boolean;
  onClose: () => void;
}

export function DeletedGraphsDialog({ kind, ...props }: Props) {
  return (
    <Modal {...props} title={kind === "graph" ? "Deleted graphs" : "Deleted actions"} size="lg">
      <List kind={kind} />
    </Modal>
  );
}
