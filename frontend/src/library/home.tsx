/** The first page: every graph, and how to begin. */
import { Button, Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconFileImport, IconPlus } from "@tabler/icons-react";
import { Link } from "wouter";
import { type GraphSummary, useGraphs } from "../api/graphs";
import { sentence } from "../api/http";
import { useMay } from "../api/person";
import { endWords, runWord } from "../api/progress";
import { newestRun, useLive } from "../api/use-live";
import { Empty } from "../ui/empty";
import { StateWord } from "../ui/state-word";
import { ago, instant, useNow } from "../ui/when";
import { GraphMenu } from "./graph-menu";
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

function GraphCard({ graph, names }: { graph: GraphSummary; names: readonly string[] }) {
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
      <GraphMenu graph={graph} names={names} />
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
  const mayEdit = useMay("edit");
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
          {mayEdit && (
            <div className={style.buttons}>
              <Button leftSection={<IconFileImport size={16} />} onClick={onImport}>
                Import a file
              </Button>
              <Button variant="filled" leftSection={<IconPlus size={16} />} onClick={onNew}>
                New graph
              </Button>
            </div>
          )}
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
              mayEdit && (
                <Button variant="filled" onClick={onNew}>
                  New graph
                </Button>
              )
            }
          >
            {mayEdit
              ? "Begin with an empty one, or drop a UMRF file anywhere on this page."
              : "What the others make appears here."}
          </Empty>
        )}
        {list.length > 0 && (
          <div className={style.cards}>
            {list.map((graph) => (
              <GraphCard key={graph.id} graph={graph} names={list.map(({ name }) => name)} />
            ))}
          </div>
        )}
      </div>
    </main>
  );
}
