/** Graphs of a folder as cards: searched, sorted, by label. */
import { NativeSelect, Skeleton, TextInput } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { IconAlertTriangle, IconSearch } from "@tabler/icons-react";
import { type ComponentProps, type ReactNode, useEffect, useMemo, useState } from "react";
import { type Folder, folderPath } from "../api/folders";
import { useGraphLabels, useGraphPages } from "../api/graph-list";
import { errorText } from "../api/http";
import { newestRun } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useRuns } from "../api/runs";
import { Empty } from "../ui/empty";
import { useKept } from "../ui/hooks";
import { counted } from "../words/counted";
import { GraphCard } from "./graph-card";
import style from "./graph-card.module.css";
import { type GraphOrder, graphsWanted, lastRuns, ORDERS } from "./graph-selection";
import home from "./home.module.css";
import { MoreGraphs } from "./more-graphs";

const PAUSE = 150; // ms without a key before a search is asked

interface Props {
  folders: readonly Folder[];
  /** The one on screen; null: the graphs that are in none. */
  folder: string | null;
  /** Shown where there is no graph and no folder at all. */
  none: ReactNode;
  /** Copies on this device, shown while the list cannot be read. */
  kept: ReactNode;
  Try: ComponentProps<typeof GraphCard>["Try"];
  /** Stands before the graphs, and not before what a search or a label finds in all folders inside. */
  children: ReactNode;
}

function Skeletons() {
  return (
    <div className={home.cards} aria-hidden>
      {[0, 1, 2, 3].map((i) => (
        <div className={home.card} key={i}>
          <div className={home.preview} />
          <div className={home.body}>
            <Skeleton height={12} width="50%" mb={10} />
            <Skeleton height={9} width="90%" mb={8} />
            <Skeleton height={9} width="40%" />
          </div>
        </div>
      ))}
    </div>
  );
}

interface ToolsProps {
  search: string;
  onSearch: (search: string) => void;
  labels: readonly string[];
  label: string | null;
  onLabel: (label: string | null) => void;
  order: GraphOrder;
  onOrder: (order: GraphOrder) => void;
}

function Tools({ search, onSearch, labels, label, onLabel, order, onOrder }: ToolsProps) {
  return (
    <search className={style.tools}>
      <TextInput
        className={style.search ?? ""}
        aria-label="Search graphs"
        placeholder="Name, robot, label, person …"
        leftSection={<IconSearch size={15} aria-hidden />}
        value={search}
        onChange={(event) => onSearch(event.currentTarget.value)}
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
              aria-pressed={label === each}
              onClick={() => onLabel(label === each ? null : each)}
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
        onChange={(event) => onOrder(event.currentTarget.value as GraphOrder)}
      />
    </search>
  );
}

export function GraphList({ folders, folder, none, kept, Try, children }: Props) {
  const { now: live, runner } = useLive();
  const listed = useRuns(runner).data;
  const [typed, setTyped] = useState("");
  const [search] = useDebouncedValue(typed, PAUSE);
  const [picked, setLabel] = useState<string | null>(null);
  const [order, setOrder] = useKept<GraphOrder>("aa.graphs-by", "changed");
  const runs = useMemo(() => lastRuns([...(listed ?? []), ...live.runs.values()]), [listed, live]);
  const [hasLabels, setHasLabels] = useState(false);
  const labels = useGraphLabels(folder ?? "", hasLabels).data ?? [];
  const label = picked !== null && labels.includes(picked) ? picked : null;
  const wanted = graphsWanted({ search, label, order }, folder, runs);
  const pages = useGraphPages(wanted);
  const { graphs, total, isOld, error } = pages;
  const { deep } = wanted;
  const isEmpty = graphs?.length === 0 && !isOld;
  const isLoading = graphs === undefined && error === null;
  const isAlone = isEmpty && !deep && folders.length === 0;
  // In folders, and on pages that are not on screen, there may be some, too.
  const mayHaveLabels =
    folders.length > 0 || pages.hasMore || graphs?.some((each) => each.labels?.length);
  useEffect(() => setHasLabels((was) => was || Boolean(mayHaveLabels)), [mayHaveLabels]);
  return (
    <>
      {error !== null && (
        <>
          <Empty
            icon={<IconAlertTriangle size={22} />}
            title={
              graphs === undefined
                ? "The list of graphs could not be loaded"
                : "The list below may be out of date"
            }
          >
            {errorText(error)}
          </Empty>
          {kept}
        </>
      )}
      {isAlone && none}
      {(isLoading || graphs !== undefined) && !isAlone && (
        <>
          <Tools
            search={typed}
            onSearch={setTyped}
            labels={labels}
            label={label}
            onLabel={setLabel}
            order={order}
            onOrder={setOrder}
          />
          <p className="visually-hidden" role="status">
            {search === "" || isOld ? "" : `${counted(total, "graph")} found`}
          </p>
          {!deep && children}
          {!deep && isEmpty && (
            <p className="quiet-12">
              {folder === null
                ? "Every graph is in a folder."
                : "No graph is in this folder itself."}
            </p>
          )}
          {deep && isEmpty && (
            <Empty icon={<IconSearch size={22} />} title="No graph says that">
              Names, descriptions, robots, labels and the people in them are searched.
            </Empty>
          )}
          {isLoading && <Skeletons />}
          <div className={home.cards} aria-busy={isOld}>
            {graphs?.map((graph) => (
              <GraphCard
                key={graph.id}
                graph={graph}
                last={newestRun(live, graph.id) ?? runs.get(graph.id) ?? null}
                place={deep && graph.folder !== folder ? folderPath(folders, graph.folder) : ""}
                Try={Try}
              />
            ))}
          </div>
          <MoreGraphs pages={pages} />
        </>
      )}
    </>
  );
}
