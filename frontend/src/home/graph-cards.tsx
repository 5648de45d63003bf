/** Graphs of a folder as cards: searched, sorted, by label; each says how it is and who is in it. */
import { NativeSelect, TextInput } from "@mantine/core";
import { IconSearch } from "@tabler/icons-react";
import { type ReactNode, useMemo, useState } from "react";
import { Link } from "wouter";
import { type Folder, folderPath, graphsInFolder } from "../api/folders";
import type { GraphSummary } from "../api/graphs";
import { newestRun } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useKnownColors } from "../api/people";
import { type Run, useRuns } from "../api/runs";
import { useRunStatus } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { Empty } from "../ui/empty";
import { useKept } from "../ui/hooks";
import { boundedPart } from "../ui/lazy-part";
import { colorOfName, initials, nameColors } from "../ui/name-colors";
import { ago, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./graph-cards.module.css";
import { GraphCounts } from "./graph-counts";
import { GraphMenu } from "./graph-menu";
import { allLabels, type GraphOrder, lastRuns, ORDERS, selectGraphs } from "./graph-selection";
import home from "./home.module.css";

/** Decoration, and the reading and laying out of graphs with it: the list is there without. */
const GraphPreview = boundedPart(
  () => import("./graph-preview").then((part) => part.GraphPreview),
  { frame: () => null },
);

const FEW = 4; // robots or labels on a card

function LastRun({ run, now }: { run: Run; now: number }) {
  const going = run.ended_at === null;
  const at = instant(run.ended_at ?? run.started_at ?? run.requested_at);
  return (
    <StateLabel {...useRunStatus(run)} {...(at === null || going ? {} : { more: ago(at, now) })} />
  );
}

function People({ people }: { people: NonNullable<GraphSummary["people"]> }) {
  const colorOf = useKnownColors(people.map(({ id }) => id));
  if (people.length === 0) return null;
  const names = people.map(({ name }) => isolated(name || "Guest")).join(", ");
  return (
    <span className={style.people} title={`Now here: ${names}`}>
      <span className="visually-hidden">Now here: {names}</span>
      {people.slice(0, FEW).map(({ id, name }) => (
        <i key={id} style={{ background: colorOf(id) }} aria-hidden>
          {initials(name || "Guest")}
        </i>
      ))}
      {people.length > FEW && <i aria-hidden>+{people.length - FEW}</i>}
    </span>
  );
}

interface GraphCardProps {
  graph: GraphSummary;
  names: readonly string[];
  last: Run | null;
  /** The names on the way to its folder, where it is in another one than the one on screen. */
  place: string;
}

function GraphCard({ graph, names, last, place }: GraphCardProps) {
  const now = useNow(20_000);
  const at = instant(graph.updated_at);
  const { robots = [], labels = [], people = [] } = graph;
  return (
    <article className={home.card} style={nameColors(robots)}>
      <Link to={`/graphs/${graph.id}`} className="block ink-inherit no-underline">
        <div className={home.preview}>
          <GraphPreview graph={graph.id} seq={graph.seq} />
          <People people={people} />
        </div>
        <div className={home.body}>
          <h3 className={home.name}>{graph.name || "Untitled"}</h3>
          <p className={home.description}>{graph.description || "No description yet"}</p>
          {place !== "" && (
            <p className={`${style.marks} truncate`}>
              In <bdi>{place}</bdi>
            </p>
          )}
          {(robots.length > 0 || labels.length > 0) && (
            <p className={style.marks}>
              {robots.slice(0, FEW).map((robot) => (
                <span key={robot} className={style.robot}>
                  <i style={{ background: colorOfName(robot) }} aria-hidden />
                  <span className="visually-hidden">robot </span>
                  {robot}
                </span>
              ))}
              {robots.length > FEW && <span>+{robots.length - FEW}</span>}
              {labels.slice(0, FEW).map((label) => (
                <span key={label} className={style.label}>
                  {label}
                </span>
              ))}
              {labels.length > FEW && <span>+{labels.length - FEW}</span>}
            </p>
          )}
          <div className={home.facts}>
            {last && <LastRun run={last} now={now} />}
            <GraphCounts graph={graph} />
            <span>
              {counted(graph.actions ?? 0, "action")}
              {graph.drafts && ` · ${counted(graph.drafts, "draft")}`}
              {at !== null && ` · changed ${ago(at, now)}`}
            </span>
          </div>
        </div>
      </Link>
      <GraphMenu graph={graph} names={names} />
    </article>
  );
}

interface Props {
  graphs: readonly GraphSummary[];
  folders: readonly Folder[];
  /** The one on screen; null: the graphs that are in none. */
  folder: string | null;
  /** Stands before the graphs, and not before what a search or a label finds in all folders inside. */
  children: ReactNode;
}

export function GraphCards({ graphs, folders, folder, children }: Props) {
  const { now: live, runner } = useLive();
  const listed = useRuns(runner).data;
  const [search, setSearch] = useState("");
  const [label, setLabel] = useState<string | null>(null);
  const [order, setOrder] = useKept<GraphOrder>("aa.graphs-by", "changed");
  const runs = useMemo(() => lastRuns([...(listed ?? []), ...live.runs.values()]), [listed, live]);
  const below = graphsInFolder(graphs, folders, folder, true);
  const labels = allLabels(below);
  const wish = { search, label: label !== null && labels.includes(label) ? label : null, order };
  const deep = search.trim() !== "" || wish.label !== null;
  const here = deep ? below : graphsInFolder(graphs, folders, folder, false);
  const shown = selectGraphs(here, wish, runs);
  const names = graphs.map(({ name }) => name);
  return (
    <>
      <search className={style.tools}>
        <TextInput
          className={style.search ?? ""}
          aria-label="Search graphs"
          placeholder="Name, robot, label, person …"
          leftSection={<IconSearch size={15} aria-hidden />}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
          data-search
        />
        {labels.length > 0 && (
          <fieldset className="fieldset-reset wrap gap-37_5">
            <legend className="visually-hidden">Only with the label</legend>
            {labels.map((each) => (
              <button
                key={each}
                type="button"
                className={`${style.pick} finger`}
                aria-pressed={wish.label === each}
                onClick={() => setLabel(wish.label === each ? null : each)}
              >
                {each}
              </button>
            ))}
          </fieldset>
        )}
        <NativeSelect
          className={style.order ?? ""}
          aria-label="Sort by"
          data={Object.entries(ORDERS).map(([value, words]) => ({ value, label: words }))}
          value={order}
          onChange={(event) => setOrder(event.currentTarget.value as GraphOrder)}
        />
      </search>
      <p className="visually-hidden" role="status">
        {search === "" ? "" : `${shown.length} of ${below.length} graphs`}
      </p>
      {!deep && children}
      {!deep && shown.length === 0 && (
        <p className="quiet-12">
          {folder === null ? "Every graph is in a folder." : "No graph is in this folder itself."}
        </p>
      )}
      {deep && shown.length === 0 && (
        <Empty icon={<IconSearch size={22} />} title="No graph says that">
          Names, descriptions, robots, labels and the people in them are searched.
        </Empty>
      )}
      <div className={home.cards}>
        {shown.map((graph) => (
          <GraphCard
            key={graph.id}
            graph={graph}
            names={names}
            last={newestRun(live, graph.id) ?? runs.get(graph.id) ?? null}
            place={deep && graph.folder !== folder ? folderPath(folders, graph.folder) : ""}
          />
        ))}
      </div>
    </>
  );
}
