/** The first page: every graph, and how to begin. */
import { Button, Menu, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconAlertTriangle,
  IconDots,
  IconFileImport,
  IconPlus,
  IconShare3,
  IconTrash,
} from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { Link } from "wouter";
import {
  deleteGraph,
  type GraphSummary,
  recoverGraph,
  refreshGraphs,
  useGraphs,
} from "../api/graphs";
import { sentence } from "../api/http";
import { endWords, runWord } from "../api/progress";
import { newestRun, useLive } from "../api/use-live";
import { Empty } from "../ui/empty";
import { StateWord } from "../ui/state-word";
import { ago, instant, useNow } from "../ui/when";
import style from "./home.module.css";
import { Preview } from "./preview";

interface Props {
  onNew: () => void;
  onImport: () => void;
}

function Problems({ graph }: { graph: GraphSummary }) {
  const { error = 0, warning = 0 } = graph.problems ?? {};
  const count = error + warning;
  if (count === 0) return null;
  return (
    <span className={style.problems} data-worst={error > 0 ? "error" : "warning"}>
      <IconAlertTriangle size={13} aria-hidden />
      {count === 1 ? "1 problem" : `${count} problems`}
    </span>
  );
}

function CardMenu({ graph }: { graph: GraphSummary }) {
  const client = useQueryClient();
  const bringBack = async (notice: string) => {
    notifications.hide(notice);
    try {
      await recoverGraph(graph.id);
    } catch (error) {
      notifications.show({ color: "red", title: "Not brought back", message: sentence(error) });
    }
    await refreshGraphs(client);
  };
  const remove = async () => {
    try {
      await deleteGraph(graph.id);
      const id = `deleted-${graph.id}`;
      notifications.show({
        id,
        title: `${graph.name} is deleted`,
        message: (
          <Button size="compact-sm" mt="xs" onClick={() => void bringBack(id)}>
            Bring it back
          </Button>
        ),
        autoClose: 12_000,
      });
    } catch (error) {
      notifications.show({ color: "red", title: "Not deleted", message: sentence(error) });
    }
    await refreshGraphs(client);
  };
  return (
    <Menu>
      <Menu.Target>
        <button type="button" className={style.more} aria-label={`More about ${graph.name}`}>
          <IconDots size={16} aria-hidden />
        </button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item
          component="a"
          href={`/api/graphs/${encodeURIComponent(graph.id)}/umrf`}
          download={`${graph.name || "graph"}.umrf.graph.json`}
          leftSection={<IconShare3 size={15} />}
        >
          Export as UMRF
        </Menu.Item>
        <Menu.Item color="red" leftSection={<IconTrash size={15} />} onClick={() => void remove()}>
          Delete
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}

function GraphCard({ graph }: { graph: GraphSummary }) {
  const { now: live } = useLive();
  const now = useNow(20_000);
  const run = newestRun(live, graph.id);
  const at = instant(graph.updated_at);
  return (
    <article className={style.card}>
      <Link to={`/graphs/${graph.id}`} className={style.open}>
        <div className={style.preview}>
          <Preview graph={graph.id} seq={graph.seq} />
        </div>
        <div className={style.body}>
          <h3 className={style.name}>{graph.name || "Untitled"}</h3>
          <p className={style.description}>{graph.description || "No description yet"}</p>
          <div className={style.facts}>
            {run && (
              <StateWord
                tone={runWord(run).tone}
                word={run.ended_at === null ? runWord(run).word : endWords(run)}
              />
            )}
            <Problems graph={graph} />
            <span>
              {graph.actions === 1 ? "1 action" : `${graph.actions ?? 0} actions`}
              {at !== null && ` · changed ${ago(at, now)}`}
            </span>
          </div>
        </div>
      </Link>
      <CardMenu graph={graph} />
    </article>
  );
}

function Skeletons() {
  return (
    <div className={style.cards} aria-hidden>
      {[0, 1, 2, 3].map((i) => (
        <div className={style.card} key={i}>
          <div className={style.preview} />
          <div className={style.body}>
            <Skeleton height={12} width="50%" mb={10} />
            <Skeleton height={9} width="90%" mb={8} />
            <Skeleton height={9} width="40%" />
          </div>
        </div>
      ))}
    </div>
  );
}

export function Home({ onNew, onImport }: Props) {
  const graphs = useGraphs();
  const list = graphs.data ?? [];
  return (
    <main className={style.page}>
      <div className={style.inner}>
        <div className={style.hello}>
          <div>
            <h2 className={style.title}>What should the robots do?</h2>
            <p className={style.lead}>
              Draw a task as a graph of actions, say what follows each outcome, run it in the
              simulator, and look at what happened. The examples below show one idea each.
            </p>
          </div>
          <div className={style.buttons}>
            <Button leftSection={<IconFileImport size={16} />} onClick={onImport}>
              Import a file
            </Button>
            <Button variant="filled" leftSection={<IconPlus size={16} />} onClick={onNew}>
              New graph
            </Button>
          </div>
        </div>
        {graphs.isPending && <Skeletons />}
        {graphs.isError && (
          <Empty icon={<IconAlertTriangle size={22} />} title="The list cannot be read">
            {sentence(graphs.error)}
          </Empty>
        )}
        {graphs.isSuccess && list.length === 0 && (
          <Empty
            icon={<IconPlus size={22} />}
            title="No graph yet"
            action={
              <Button variant="filled" onClick={onNew}>
                New graph
              </Button>
            }
          >
            Begin with an empty one, or drop a UMRF file anywhere on this page.
          </Empty>
        )}
        {list.length > 0 && (
          <div className={style.cards}>
            {list.map((graph) => (
              <GraphCard key={graph.id} graph={graph} />
            ))}
          </div>
        )}
      </div>
    </main>
  );
}
