/** Menu of a graph: rename, duplicate, move to a folder, export, delete and restore. */
import { Button, Menu } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconCopy,
  IconFolderSymlink,
  IconLock,
  IconPencil,
  IconShare3,
  IconTrash,
} from "@tabler/icons-react";
import { type QueryClient, useQueryClient } from "@tanstack/react-query";
import { type ComponentProps, type ReactElement, useState } from "react";
import { fileGraph } from "../api/folders";
import { fetchGraphNames } from "../api/graph-names";
import {
  deleteGraph,
  duplicateGraph,
  type GraphSummary,
  recoverGraph,
  refreshGraphs,
  renameGraph,
} from "../api/graphs";
import { errorText } from "../api/http";
import { fetchLibrary, usedIn } from "../api/library";
import { serverPath } from "../api/page-url";
import { useMay } from "../api/people";
import { useOpening } from "../ui/late-opening";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { isolated } from "../words/isolated";

/** Return the first of "x copy", "x copy 2" … that no graph is called. */
export function copyName(name: string, taken: readonly string[]): string {
  const stem = `${name || "untitled"} copy`;
  for (let n = 1; ; n += 1) {
    const next = n === 1 ? stem : `${stem} ${n}`;
    if (!taken.includes(next)) return next;
  }
}

/** Does it, says so if it fails, and reads the list again either way. True when it is done. */
async function attempt(
  client: QueryClient,
  failed: string,
  work: () => Promise<unknown>,
): Promise<boolean> {
  try {
    await work();
    return true;
  } catch (error) {
    notifications.show({ color: "red", title: failed, message: errorText(error) });
    return false;
  } finally {
    await refreshGraphs(client);
  }
}

function offerBack(client: QueryClient, graph: GraphSummary): void {
  const id = `deleted-${graph.id}`;
  const bringBack = () => {
    notifications.hide(id);
    void attempt(client, "Not brought back", () => recoverGraph(graph.id));
  };
  notifications.show({
    id,
    title: `${isolated(graph.name)} is deleted`,
    message: (
      <Button size="compact-sm" mt="xs" onClick={bringBack}>
        Bring it back
      </Button>
    ),
    autoClose: 12_000,
  });
}

const RenameDialog = lazyPart(() => import("./rename-dialog").then((part) => part.RenameDialog));

const MoveDialog = lazyPart(() => import("./folder-dialogs").then((part) => part.MoveDialog));

const RuleDialog = lazyPart(() => import("./rule-dialog").then((part) => part.RuleDialog));

const RenamedUses = lazyPart(() =>
  import("../canvas/renamed-uses").then((part) => part.RenamedUses),
);

type Renamed = Pick<ComponentProps<typeof RenamedUses>, "before" | "name" | "uses">;

/** The menu, around its button. */
export function GraphMenu({ graph, button }: { graph: GraphSummary; button: ReactElement }) {
  const [opened, setOpened] = useOpening();
  const client = useQueryClient();
  const mayEdit = useMay("edit");
  const mayShare = useMay("share");
  const [ruling, setRuling] = useState<boolean | null>(null);
  const [renaming, setRenaming] = useState<boolean | null>(null);
  const [moving, setMoving] = useState<boolean | null>(null);
  const [renamed, setRenamed] = useState<Renamed | null>(null);
  const rename = async (name: string) => {
    let uses: Renamed["uses"] = [];
    const done = await attempt(client, "Not renamed", async () => {
      const graphs = await fetchGraphNames(client);
      const named = new Map(graphs.map((each) => [each.id, each.name]));
      // Where several graphs have the name it may stand for another of them: the check tells that.
      const isOnly = graphs.filter((each) => each.name === graph.name).length === 1;
      const ids = isOnly ? usedIn(await fetchLibrary(), graph) : [];
      uses = ids.map((id) => ({ id, name: named.get(id) ?? "" }));
      await renameGraph(graph.id, name);
    });
    if (done && uses.length > 0) setRenamed({ before: graph.name, name, uses });
    return done;
  };
  const duplicate = () =>
    attempt(client, "Not duplicated", async () => {
      const names = (await fetchGraphNames(client)).map((each) => each.name);
      await duplicateGraph(graph, copyName(graph.name, names));
    });
  const remove = async () => {
    const done = await attempt(client, "Not deleted", () => deleteGraph(graph.id));
    if (done) offerBack(client, graph);
  };
  return (
    <>
      <Menu opened={opened} onChange={setOpened}>
        <Menu.Target>{button}</Menu.Target>
        <Menu.Dropdown>
          {!mayEdit && <Menu.Label>View only</Menu.Label>}
          <Menu.Item
            leftSection={<IconPencil size={15} />}
            disabled={!mayEdit}
            onClick={() => setRenaming(true)}
          >
            Rename …
          </Menu.Item>
          <Menu.Item
            leftSection={<IconCopy size={15} />}
            disabled={!mayEdit}
            onClick={() => void duplicate()}
          >
            Duplicate
          </Menu.Item>
          <Menu.Item
            leftSection={<IconFolderSymlink size={15} />}
            disabled={!mayEdit}
            onClick={() => setMoving(true)}
          >
            Move to folder …
          </Menu.Item>
          {mayShare && (
            <Menu.Item leftSection={<IconLock size={15} />} onClick={() => setRuling(true)}>
              Who may see and edit it …
            </Menu.Item>
          )}
          <Menu.Item
            component="a"
            href={serverPath(`/api/graphs/${encodeURIComponent(graph.id)}/umrf`)}
            download={`${graph.name || "graph"}.umrf.graph.json`}
            leftSection={<IconShare3 size={15} />}
          >
            Export as UMRF
          </Menu.Item>
          <Menu.Item
            c="var(--error)"
            leftSection={<IconTrash size={15} />}
            disabled={!mayEdit}
            onClick={() => void remove()}
          >
            Delete
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <OverlayBoundary>
        {renaming !== null && (
          <RenameDialog
            graph={graph}
            opened={renaming}
            onClose={() => setRenaming(false)}
            onRename={rename}
          />
        )}
        {moving !== null && (
          <MoveDialog
            name={graph.name}
            from={graph.folder ?? null}
            move={(into) => fileGraph(graph.id, into)}
            opened={moving}
            onClose={() => setMoving(false)}
          />
        )}
        {ruling !== null && (
          <RuleDialog
            ruled={{ kind: "graph", id: graph.id }}
            name={graph.name}
            isInside={graph.folder !== undefined}
            opened={ruling}
            onClose={() => setRuling(false)}
          />
        )}
        {renamed !== null && (
          <RenamedUses graph={graph.id} {...renamed} onClose={() => setRenamed(null)} />
        )}
      </OverlayBoundary>
    </>
  );
}
