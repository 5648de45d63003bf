/** The list on the left: graphs to open, actions to place. */
import { ActionIcon, Kbd, TextInput } from "@mantine/core";
import { IconFileImport, IconPlus, IconSearch } from "@tabler/icons-react";
import { useState } from "react";
import { useGraphs } from "../api/graphs";
import { useMay } from "../api/use-person";
import type { NewAction } from "../graph/edit";
import { Tooltip } from "../ui/floating/tooltip";
import { ActionRow } from "./action-row";
import { GraphRow, RowSkeletons } from "./graph-rows";
import { matchesSearch } from "./graph-selection";
import { signature, useKnownActions } from "./known-actions";
import style from "./sidebar.module.css";

interface Props {
  current?: string;
  onNew: () => void;
  onImport: () => void;
  /** Puts an action on the canvas; absent where there is none. */
  onPlace?: (template: NewAction) => void;
}

function ActionList({ search, onPlace }: { search: string; onPlace: (t: NewAction) => void }) {
  const { actions, ready } = useKnownActions();
  const shown = actions.filter(({ template }) =>
    matchesSearch(search, template.name, template.description, signature(template)),
  );
  const fresh = search.trim();
  const exact = shown.some(({ template }) => template.name === fresh);
  if (!ready) return <RowSkeletons count={4} />;
  return (
    <>
      {shown.map((known) => (
        <ActionRow key={known.template.name} known={known} onPlace={onPlace} />
      ))}
      {fresh !== "" && !exact && (
        <ActionRow
          known={{ template: { name: fresh }, document: null, usedIn: [], takes: [], gives: [] }}
          onPlace={onPlace}
        />
      )}
      {shown.length === 0 && fresh === "" && (
        <p className={style.hint}>
          Actions appear here once a graph uses them. Type a name above to make a new one.
        </p>
      )}
    </>
  );
}

export function Sidebar({ current, onNew, onImport, onPlace }: Props) {
  const [search, setSearch] = useState("");
  const mayEdit = useMay("edit");
  const graphs = useGraphs();
  const shown = (graphs.data ?? []).filter((graph) =>
    matchesSearch(
      search,
      graph.name,
      graph.description,
      ...(graph.robots ?? []),
      ...(graph.labels ?? []),
    ),
  );
  return (
    <div className={style.sidebar}>
      <TextInput
        aria-label="Search graphs and actions"
        placeholder="Search graphs and actions"
        leftSection={<IconSearch size={15} aria-hidden />}
        rightSection={search === "" ? <Kbd>/</Kbd> : undefined}
        value={search}
        onChange={(event) => setSearch(event.currentTarget.value)}
        data-search
      />
      <div className={style.scroll}>
        <div className={style.heading} data-heading="Graphs">
          <h2>Graphs</h2>
          {mayEdit && (
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
          )}
        </div>
        {graphs.isPending && <RowSkeletons count={4} />}
        <nav aria-label="Graphs">
          {shown.map((graph) => (
            <GraphRow key={graph.id} graph={graph} current={graph.id === current} />
          ))}
        </nav>
        {graphs.isSuccess && shown.length === 0 && (
          <p className={style.hint}>{search === "" ? "No graph yet." : "No graph is called so."}</p>
        )}
        {onPlace && mayEdit && (
          <>
            <div className={style.heading} data-heading="Actions">
              <h2>Actions</h2>
              <span className={style.how}>drag or tap to place</span>
            </div>
            <ActionList search={search} onPlace={onPlace} />
          </>
        )}
      </div>
    </div>
  );
}
