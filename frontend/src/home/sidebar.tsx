/** The list on the left: graphs to open, or actions to place. */
import { ActionIcon, Kbd, TextInput } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { IconFileImport, IconPlus, IconSearch } from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import { useGraphPages } from "../api/graph-list";
import { useMay } from "../api/people";
import type { NewAction } from "../graph/edit";
import { useListTab } from "../ui/hooks";
import { lazyPart, PartBoundary } from "../ui/lazy-part";
import { Tooltip } from "../ui/tooltip";
import { GraphRow, RowSkeletons } from "./graph-rows";
import { MoreGraphs } from "./more-graphs";
import style from "./sidebar.module.css";

const PlaceableActions = lazyPart(() =>
  import("./placeable-actions").then((part) => part.PlaceableActions),
);

const PAUSE = 150; // ms without a key before a search is asked

interface Props {
  current?: string;
  onNew: () => void;
  onImport: () => void;
  /** Puts an action on the canvas; absent where there is none. */
  onPlace?: (template: NewAction) => void;
}

function Tools({ onNew, onImport }: Pick<Props, "onNew" | "onImport">) {
  return (
    <>
      <Tooltip label="Import a file">
        <ActionIcon size="sm" aria-label="Import a file" onClick={onImport}>
          <IconFileImport size={15} />
        </ActionIcon>
      </Tooltip>
      <Tooltip label="New graph">
        <ActionIcon size="sm" aria-label="New graph" onClick={onNew}>
          <IconPlus size={15} />
        </ActionIcon>
      </Tooltip>
    </>
  );
}

function GraphList({ typed, current }: { typed: string; current: string | undefined }) {
  const [search] = useDebouncedValue(typed, PAUSE);
  const pages = useGraphPages({ search });
  const { graphs } = pages;
  return (
    <>
      {graphs === undefined && <RowSkeletons count={4} />}
      <nav aria-label="Graphs">
        {graphs?.map((graph) => (
          <GraphRow key={graph.id} graph={graph} current={graph.id === current} />
        ))}
      </nav>
      <MoreGraphs pages={pages} />
      {graphs?.length === 0 && (
        <p className={style.hint}>{search === "" ? "No graph yet." : "No graph has this name."}</p>
      )}
    </>
  );
}

export function Sidebar({ current, onNew, onImport, onPlace }: Props) {
  const [search, setSearch] = useState("");
  const [wanted] = useListTab();
  const mayEdit = useMay("edit");
  const mayPlace = onPlace !== undefined && mayEdit;
  const tab = mayPlace ? wanted : "graphs";
  const words = mayPlace ? "Search graphs and actions" : "Search graphs";
  return (
    <div className={style.sidebar}>
      <TextInput
        aria-label={words}
        placeholder={words}
        leftSection={<IconSearch size={15} aria-hidden />}
        rightSection={search === "" ? <Kbd>/</Kbd> : undefined}
        value={search}
        onChange={(event) => setSearch(event.currentTarget.value)}
        data-search
      />
      <div className={style.heading}>
        <h2>{tab === "graphs" ? "Graphs" : "Actions"}</h2>
        {tab === "actions" && <Link to="/actions">The library</Link>}
        {mayEdit && tab === "graphs" && <Tools onNew={onNew} onImport={onImport} />}
      </div>
      <div className={style.scroll}>
        {tab === "graphs" ? (
          <GraphList typed={search} current={current} />
        ) : (
          <PartBoundary waiting={<RowSkeletons count={4} />}>
            {onPlace && <PlaceableActions search={search} current={current} onPlace={onPlace} />}
          </PartBoundary>
        )}
      </div>
    </div>
  );
}
