/** The list of all actions: searched, filtered, and how to begin. */
import { Button, Kbd, TextInput } from "@mantine/core";
import { IconFileImport, IconPlus, IconSearch } from "@tabler/icons-react";
import { type ReactNode, useDeferredValue, useMemo, useRef, useState } from "react";
import { useMay } from "../api/use-person";
import { useSearchKey } from "../ui/hooks/use-search-key";
import { isolated } from "../words/isolated";
import { ActionRows } from "./action-rows";
import style from "./actions-page.module.css";
import { type ActionFilter, foundActions, type ListedAction } from "./listing";
import { useRowKeys, useRowPresses } from "./use-rows";

interface Props {
  actions: readonly ListedAction[];
  robots: readonly string[];
  /** Which is open: its address. */
  current: string | null;
  onNew: (name: string) => void;
  onImport: () => void;
  /** Below the list. */
  foot: ReactNode;
}

const WORDS: readonly (readonly [ActionFilter, string])[] = [
  ["all", "All"],
  ["library", "In the library"],
  ["graphs", "Only in graphs"],
];

interface FilterProps {
  robots: readonly string[];
  filter: ActionFilter;
  onFilter: (filter: ActionFilter) => void;
}

function Filters({ robots, filter, onFilter }: FilterProps) {
  const all = [
    ...WORDS,
    ...robots.map(
      (robot) => [`robot:${robot}`, `On ${isolated(robot)}`] as readonly [ActionFilter, string],
    ),
  ];
  return (
    <fieldset className={style.filters}>
      <legend className="visually-hidden">Which actions</legend>
      {all.map(([value, words]) => (
        <button
          key={value}
          type="button"
          className={style.filter}
          aria-pressed={value === filter}
          onClick={() => onFilter(value)}
        >
          {words}
        </button>
      ))}
    </fieldset>
  );
}

function Tools({ onNew, onImport }: { onNew: () => void; onImport: () => void }) {
  return (
    <div className={style.tools}>
      <Button leftSection={<IconPlus size={15} aria-hidden />} onClick={onNew}>
        New action
      </Button>
      <Button
        variant="subtle"
        color="gray"
        leftSection={<IconFileImport size={15} aria-hidden />}
        onClick={onImport}
      >
        Import
      </Button>
    </div>
  );
}

export function ActionList({ actions, robots, current, onNew, onImport, foot }: Props) {
  const mayEdit = useMay("edit");
  const [search, setSearch] = useState("");
  const [filter, setFilter] = useState<ActionFilter>("all");
  // Typing is never held up by the list.
  const wanted = useDeferredValue(search);
  const shown = useMemo(() => foundActions(actions, filter, wanted), [actions, filter, wanted]);
  // What the list offers is of one search.
  const fresh = wanted.trim();
  const exact = actions.some(({ name }) => name === fresh);
  const list = useRef<HTMLDivElement>(null);
  useSearchKey();
  useRowKeys(list);
  useRowPresses(list);
  return (
    <div className={style.list} ref={list}>
      <TextInput
        aria-label="Search actions"
        placeholder={`Search ${actions.length} actions`}
        leftSection={<IconSearch size={15} aria-hidden />}
        rightSection={search === "" ? <Kbd>/</Kbd> : undefined}
        value={search}
        onChange={(event) => setSearch(event.currentTarget.value)}
        data-search
      />
      <Filters robots={robots} filter={filter} onFilter={setFilter} />
      <p className="visually-hidden" role="status">
        {shown.length === 1 ? "1 action" : `${shown.length} actions`}
      </p>
      <nav aria-label="Actions" className={style.scroll} aria-busy={wanted !== search}>
        <ActionRows actions={shown} current={current} />
        {shown.length === 0 && (
          <p className={style.hint}>
            {actions.length === 0 ? "No action yet." : "No action is found."}
          </p>
        )}
        {mayEdit && fresh !== "" && !exact && (
          <button type="button" className={style.row} data-row onClick={() => onNew(fresh)}>
            <span className={style.name}>
              <IconPlus size={13} aria-hidden /> New action “{fresh}”
            </span>
          </button>
        )}
        {foot}
      </nav>
      {mayEdit && <Tools onNew={() => onNew(search.trim())} onImport={onImport} />}
    </div>
  );
}
