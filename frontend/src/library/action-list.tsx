/** The list of all actions, with search, filters and keys. */

import { Button, Kbd, TextInput } from "@mantine/core";
import { IconAlertTriangle, IconFileImport, IconPlus, IconSearch } from "@tabler/icons-react";
import {
  memo,
  type ReactNode,
  type RefObject,
  useDeferredValue,
  useEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import { useLocation, useRouter } from "wouter";
import { useMay } from "../api/people";
import { useSearchKey } from "../ui/hooks";
import { keyOf } from "../ui/keys";
import { LongList } from "../ui/long-list";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./actions-page.module.css";
import { type ActionFilter, addressOf, foundActions, type ListedAction } from "./listing";

/** Moves the focus with the arrow keys through the rows, and from the search field into them. */
function useRowKeys(list: RefObject<HTMLElement | null>): void {
  useEffect(() => {
    const element = list.current;
    const walk = (event: KeyboardEvent) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[keyOf(event)];
      if (step === undefined || element === null) return;
      const rows = [...element.querySelectorAll<HTMLElement>("[data-row], [data-search]")];
      const at = rows.findIndex((row) => row.contains(document.activeElement));
      if (at < 0) return;
      event.preventDefault();
      rows[Math.max(0, Math.min(rows.length - 1, at + step))]?.focus();
    };
    element?.addEventListener("keydown", walk);
    return () => element?.removeEventListener("keydown", walk);
  }, [list]);
}

/** Opens a clicked link without loading the page anew; clicks with a modifier key are left to the browser. */
function useRowPresses(list: RefObject<HTMLElement | null>): void {
  const { base } = useRouter();
  const [, go] = useLocation();
  useEffect(() => {
    const element = list.current;
    const press = (event: MouseEvent) => {
      const { target, button, metaKey, ctrlKey, shiftKey, altKey } = event;
      if (button !== 0 || metaKey || ctrlKey || shiftKey || altKey) return;
      const link = target instanceof Element ? target.closest("a[data-row]") : null;
      const to = link?.getAttribute("href");
      if (!to) return;
      event.preventDefault();
      go(to.slice(base.length));
    };
    element?.addEventListener("click", press);
    return () => element?.removeEventListener("click", press);
  }, [list, base, go]);
}

interface ActionRowProps {
  listed: ListedAction;
  base: string;
  current: boolean;
}

/** Return the origin of an action that is not in the library. */
function source({ action }: ListedAction): string {
  if (action === null) return "on a robot";
  return action.document === null ? "only in graphs" : "";
}

const Row = memo(function Row({ listed, base, current }: ActionRowProps) {
  const { name, summary, action } = listed;
  const uses = action?.used_in.length ?? 0;
  const older = action?.differs_in.length ?? 0;
  const from = source(listed);
  return (
    <a
      href={base + addressOf(listed)}
      className={style.row}
      aria-current={current ? "page" : undefined}
      data-row
    >
      <span className="row gap-35 weight-600">
        <bdi className="flex-1 truncate">{name || "Without a name"}</bdi>
        {older > 0 && (
          <span className="inline-flex flex-none ink-warn" title={`Older parameters in ${older}`}>
            <IconAlertTriangle size={13} aria-hidden />
            <span className="visually-hidden"> older parameters in {older}</span>
          </span>
        )}
        {uses > 0 && (
          <span className={style.count} title={`Used in ${uses}`}>
            <span className="visually-hidden"> used in </span>
            {uses}×
          </span>
        )}
      </span>
      <span className={style.sub}>
        {from !== "" && <i>{from}</i>}
        {summary}
      </span>
    </a>
  );
});

interface ActionRowsProps {
  actions: readonly ListedAction[];
  current: string | null;
}

function ActionRows({ actions, current }: ActionRowsProps) {
  const { base } = useRouter();
  return (
    <LongList rowHeight={3}>
      {actions.map((listed) => (
        <Row
          key={listed.name}
          listed={listed}
          base={base}
          current={addressOf(listed) === current}
        />
      ))}
    </LongList>
  );
}

interface Props {
  actions: readonly ListedAction[];
  robots: readonly string[];
  /** The address of the open action. */
  current: string | null;
  onNew: (name: string) => void;
  onImport: () => void;
  /** Content below the list. */
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
    <fieldset className="m-0 p-0 border-0 wrap gap-25">
      <legend className="visually-hidden">Which actions</legend>
      {all.map(([value, words]) => (
        <button
          key={value}
          type="button"
          className={`${style.filter} finger`}
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
    <div className={`${style.tools} fingers`}>
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
  // Filtering is deferred, so that typing is never delayed.
  const wanted = useDeferredValue(search);
  const found = useMemo(() => foundActions(actions, filter, wanted), [actions, filter, wanted]);
  // A new action is offered for the text that the list was filtered by.
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
        {counted(found.length, "action")}
      </p>
      <nav aria-label="Actions" className={style.scroll} aria-busy={wanted !== search}>
        <ActionRows actions={found} current={current} />
        {found.length === 0 && (
          <p className={style.hint}>
            {actions.length === 0 ? "No action yet." : "No action is found."}
          </p>
        )}
        {mayEdit && fresh !== "" && !exact && (
          <button type="button" className={style.row} data-row onClick={() => onNew(fresh)}>
            <span className="row gap-35 weight-600">
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
