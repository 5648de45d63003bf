/**
 * Shows the way out of an inner graph, and the graphs that contain this one, which every edit here
 * changes.
 */

import { Menu } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconSitemap, IconStairsUp } from "@tabler/icons-react";
import { useEffect } from "react";
import { Link } from "wouter";
import { usedIn, useLibrary } from "../api/library";
import { useEditorStore } from "../canvas/editor-store";
import { useEditorContext } from "../edit-actions/editor-context";
import { useWatched } from "../ui/watched";
import { isolated } from "../words/isolated";
import style from "./levels.module.css";

/** Return the ids of the graphs with an action that stands for this one. */
function useUsedIn(): readonly string[] {
  const { id, graph, store } = useEditorContext();
  const { data: actions = [] } = useLibrary();
  const stands = useWatched(store.graphsInside, (inside) => inside?.isNamed ?? false);
  return stands ? usedIn(actions, { id, name: graph.name }) : [];
}

const MANY = 2; // graphs from which on the notice is shown
/** Ids of the graphs for which this page has shown the notice. */
const told = new Set<string>();

/** Shows at the first edit that it changes several other graphs, too. */
function useNoticeOfMany(graphs: readonly string[]): void {
  const { id, undo, store } = useEditorContext();
  const count = graphs.length;
  useEffect(() => {
    const tell = ({ type }: { type: "undo" | "redo" }) => {
      if (type !== "undo" || count < MANY || told.has(id)) return;
      told.add(id);
      const names = graphs.map((graph) => store.graphsInside.now()?.names.get(graph) || "Untitled");
      notifications.show({
        color: "yellow",
        autoClose: NOTICE_MS,
        title: `This graph runs inside ${count} others`,
        message: `Your changes here apply in each of them: ${names.slice(0, NAMED).map(isolated).join(", ")}${count > NAMED ? " …" : "."} Undo takes it back.`,
      });
    };
    undo.on("stack-item-added", tell);
    return () => undo.off("stack-item-added", tell);
  }, [id, undo, store, graphs, count]);
}

const NOTICE_MS = 12_000;
const NAMED = 4;

function UsedIn() {
  const graphs = useUsedIn();
  const { graphsInside } = useEditorStore();
  useNoticeOfMany(graphs);
  if (graphs.length === 0) return null;
  const words = graphs.length === 1 ? "in 1 graph" : `in ${graphs.length} graphs`;
  return (
    <Menu position="bottom-start" width={300}>
      <Menu.Target>
        <button
          type="button"
          className={style.used}
          title="Graphs that run this one inside them"
          aria-label={`Used ${words}`}
        >
          <IconSitemap size={13} aria-hidden /> <span>Used {words}</span>
        </button>
      </Menu.Target>
      <Menu.Dropdown>
        <p className={style.words}>
          Your changes here apply in each of them. Published versions keep what they were published
          with.
        </p>
        {graphs.map((graph) => (
          <Menu.Item key={graph} component={Link} to={`/graphs/${graph}`}>
            <bdi className="truncate">{graphsInside.now()?.names.get(graph) || "Untitled"}</bdi>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

/** The button to leave an inner graph; it replaces the line of levels on narrow screens. */
function LeaveButton() {
  const leave = useWatched(useEditorStore().graphsInside, (inside) => inside?.leave);
  if (!leave) return null;
  return (
    <button type="button" className={`${style.used} ${style.out}`} onClick={leave}>
      <IconStairsUp size={13} aria-hidden /> Out
    </button>
  );
}

export function LevelStatus() {
  return (
    <>
      <LeaveButton />
      <UsedIn />
    </>
  );
}
