/** The graphs around this one: the way out, and all that run it inside them, which each edit here changes. */
import { Menu } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconSitemap, IconStairsUp } from "@tabler/icons-react";
import { useEffect, useSyncExternalStore } from "react";
import { Link } from "wouter";
import { useLibrary } from "../api/documents/library";
import { graphsInside, usedIn } from "../canvas/graphs-inside";
import { useEditorContext } from "../edit-actions/editor-context";
import { isolated } from "../words/isolated";
import style from "./levels.module.css";

/** The graphs with an action that stands for this one, by id. */
function useUsedIn(): readonly string[] {
  const { id, graph } = useEditorContext();
  const { data: actions = [] } = useLibrary();
  const { subscribe, now } = graphsInside;
  const stands = useSyncExternalStore(subscribe, () => now()?.isNamed ?? false);
  return stands ? usedIn(actions, { id, name: graph.name }) : [];
}

const MANY = 2; // graphs around that change with this one
/** Graphs of which this page has said so. */
const told = new Set<string>();

/** Says it at the first edit: what one changes here changes elsewhere, too. */
function useNoticeOfMany(graphs: readonly string[]): void {
  const { id, undo } = useEditorContext();
  const count = graphs.length;
  useEffect(() => {
    const tell = ({ type }: { type: "undo" | "redo" }) => {
      if (type !== "undo" || count < MANY || told.has(id)) return;
      told.add(id);
      const names = graphs.map((graph) => graphsInside.now()?.names.get(graph) || "Untitled");
      notifications.show({
        color: "yellow",
        autoClose: NOTICE_MS,
        title: `This graph runs inside ${count} others`,
        message: `What you change here changes in each: ${names.slice(0, NAMED).map(isolated).join(", ")}${count > NAMED ? " …" : "."} Undo takes it back.`,
      });
    };
    undo.on("stack-item-added", tell);
    return () => undo.off("stack-item-added", tell);
  }, [id, undo, graphs, count]);
}

const NOTICE_MS = 12_000;
const NAMED = 4;

function UsedIn() {
  const graphs = useUsedIn();
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
          What you change here changes in each of them. A version that was published keeps what it
          was published with.
        </p>
        {graphs.map((graph) => (
          <Menu.Item key={graph} component={Link} to={`/graphs/${graph}`}>
            <bdi className={style.name}>{graphsInside.now()?.names.get(graph) || "Untitled"}</bdi>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

/** Where the line of levels has no room. */
function Out() {
  const { subscribe, now } = graphsInside;
  const leave = useSyncExternalStore(subscribe, () => now()?.leave);
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
      <Out />
      <UsedIn />
    </>
  );
}
