/** Filters of the list of runs: search, choices, and filters that a person saved on this device. */
import {
  ActionIcon,
  Button,
  Checkbox,
  Menu,
  Popover,
  Select,
  Stack,
  TextInput,
} from "@mantine/core";
import { useDebouncedCallback, useLocalStorage } from "@mantine/hooks";
import { IconAdjustmentsHorizontal, IconFilter, IconSearch, IconTrash } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { useGraphNames } from "../api/graph-names";
import { useVersions, versionName } from "../api/graphs";
import { CONDUCTED } from "../api/led-runs";
import { filterOf, NO_FILTER, queryOf, type RunFilter, useLabels } from "../api/review";
import { keyOf } from "../ui/keys";
import { Segments } from "../ui/segments";
import { isolated } from "../words/isolated";
import style from "./runs-page.module.css";

type Ending = Pick<RunFilter, "state" | "failed">;

/** Choices of run states, in the order in which people ask for them. */
const ENDINGS: { value: string; label: string; asks: Ending }[] = [
  { value: "all", label: "All", asks: { state: "", failed: "" } },
  {
    value: "open",
    label: "Running",
    asks: { state: "requested,published,running,paused,stopping,unknown", failed: "" },
  },
  { value: "good", label: "Finished", asks: { state: "finished", failed: "false" } },
  { value: "bad", label: "Failed", asks: { state: "", failed: "true" } },
  { value: "stopped", label: "Stopped", asks: { state: "stopped", failed: "" } },
];

function endingOf(filter: Ending): string {
  const found = ENDINGS.find(
    ({ asks }) => asks.state === filter.state && asks.failed === filter.failed,
  );
  return found?.value ?? "";
}

interface SavedFilter {
  name: string;
  query: string;
}

interface Props {
  runner: string | undefined;
  filter: RunFilter;
  onChange: (filter: RunFilter) => void;
  engines: readonly string[];
}

/** Return a filter in words; its default name when it is saved. */
function filterWords(filter: RunFilter): string {
  const ending = ENDINGS.find((each) => each.value === endingOf(filter))?.label ?? filter.state;
  const words = [
    ending === "All" ? "" : ending,
    filter.text && `“${filter.text}”`,
    filter.robot && `on ${isolated(filter.robot)}`,
    filter.label && `labelled ${isolated(filter.label)}`,
    filter.person && `by ${isolated(filter.person)}`,
    filter.pinned && "pinned",
    filter.since && `since ${dateOf(filter.since)}`,
    filter.until && `until ${dateOf(filter.until)}`,
    filter.version && "of one version",
    filter.graph && "of one graph",
  ];
  return words.filter(Boolean).join(" ") || "All runs";
}

type FilterProps = Pick<Props, "filter" | "onChange">;

function SavedFilters({ filter, onChange }: FilterProps) {
  const [saved, setSaved] = useLocalStorage<SavedFilter[]>({
    key: "aa.run-filters",
    defaultValue: [],
  });
  const query = queryOf(filter).toString();
  const known = saved.some((each) => each.query === query);
  return (
    <Menu position="bottom-end" withinPortal>
      <Menu.Target>
        <Button variant="default" aria-label="Saved" className={style.saved ?? ""}>
          <IconFilter size={15} aria-hidden />
          <span className={style.wide}>Saved</span>
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {saved.map((each) => (
          <div key={each.query} className="row">
            <Menu.Item onClick={() => onChange(filterOf(new URLSearchParams(each.query)))}>
              {each.name}
            </Menu.Item>
            <ActionIcon
              aria-label={`Forget “${isolated(each.name)}”`}
              onClick={() => setSaved(saved.filter((other) => other !== each))}
            >
              <IconTrash size={14} aria-hidden />
            </ActionIcon>
          </div>
        ))}
        {saved.length > 0 && <Menu.Divider />}
        <Menu.Item
          disabled={query === "" || known}
          onClick={() => setSaved([...saved, { name: filterWords(filter), query }])}
        >
          {query === "" ? "Filter first, then save" : `Save “${filterWords(filter)}”`}
        </Menu.Item>
        <Menu.Item disabled={query === ""} onClick={() => onChange(NO_FILTER)}>
          Show all runs
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}

function StateFilter({ filter, onChange }: FilterProps) {
  return (
    <Segments
      size="xs"
      label="State"
      data={ENDINGS.map(({ value, label }) => ({ value, label }))}
      value={endingOf(filter)}
      onChange={(value) => {
        const chosen = ENDINGS.find((each) => each.value === value);
        if (chosen) onChange({ ...filter, ...chosen.asks });
      }}
    />
  );
}

/** The search and the state; all other filters are behind one button, and on a phone the state, too. */
export function RunFilters({ runner, filter, onChange, engines }: Props) {
  const [text, setText] = useState(filter.text);
  useEffect(() => setText(filter.text), [filter.text]);
  const search = useDebouncedCallback((next: string) => onChange({ ...filter, text: next }), 250);
  return (
    <div className={style.filters}>
      <TextInput
        aria-label="Search runs"
        placeholder="Search runs"
        title="Graph, person, number or message"
        leftSection={<IconSearch size={15} aria-hidden />}
        value={text}
        onChange={(event) => {
          setText(event.currentTarget.value);
          search(event.currentTarget.value.trim());
        }}
        className={style.search ?? ""}
      />
      <div className={style.wide}>
        <StateFilter filter={filter} onChange={onChange} />
      </div>
      <MoreRunFilters {...{ runner, filter, onChange, engines }} />
      <SavedFilters filter={filter} onChange={onChange} />
    </div>
  );
}

/** Filters behind the button. */
const RARE = [
  ...(["robot", "label", "pinned", "graph", "version", "person", "since", "until"] as const),
];

/** Midnight here, as the runner takes times; empty for none. */
function momentOf(date: string, after: "begin" | "end"): string {
  const day = new Date(`${date}T00:00:00`);
  if (date === "" || Number.isNaN(day.getTime())) return "";
  if (after === "end") day.setDate(day.getDate() + 1);
  return new Date(day.getTime() - (after === "end" ? 1 : 0)).toISOString();
}

/** The day of a moment, as date fields take it. */
function dateOf(moment: string): string {
  const at = new Date(moment);
  if (moment === "" || Number.isNaN(at.getTime())) return "";
  const two = (n: number) => String(n).padStart(2, "0");
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
}

function Person({ filter, onChange }: FilterProps) {
  const [text, setText] = useState(filter.person);
  useEffect(() => setText(filter.person), [filter.person]);
  const take = () => text.trim() !== filter.person && onChange({ ...filter, person: text.trim() });
  return (
    <TextInput
      label="Started by"
      placeholder="Anybody"
      value={text}
      onChange={(event) => setText(event.currentTarget.value)}
      onBlur={take}
      onKeyDown={(event) => keyOf(event) === "Enter" && take()}
    />
  );
}

function Fields({ runner, filter, onChange, engines }: Props) {
  const labels = useLabels(runner).data ?? [];
  const graphs = useGraphNames().data ?? [];
  const versions = useVersions(filter.graph).data ?? [];
  const known = graphs.map(({ id, name }) => ({ value: id, label: name }));
  const strange = filter.graph !== "" && known.every(({ value }) => value !== filter.graph);
  return (
    <Stack gap="xs" tabIndex={-1} data-autofocus role="group" aria-label="Filters">
      <div className={style.narrow}>
        <StateFilter filter={filter} onChange={onChange} />
      </div>
      <Select
        label="Robot"
        placeholder="Any robot"
        data={engines.map((value) => ({
          value,
          label: value === CONDUCTED ? "led step by step" : value,
        }))}
        clearable
        comboboxProps={{ withinPortal: false }}
        value={filter.robot || null}
        onChange={(robot) => onChange({ ...filter, robot: robot ?? "" })}
      />
      <Select
        label="Label"
        placeholder="Any label"
        data={labels}
        clearable
        searchable
        comboboxProps={{ withinPortal: false }}
        value={filter.label || null}
        onChange={(label) => onChange({ ...filter, label: label ?? "" })}
      />
      <Checkbox
        label="Only pinned runs"
        checked={filter.pinned}
        onChange={(event) => onChange({ ...filter, pinned: event.currentTarget.checked })}
      />
      <Select
        label="Graph"
        placeholder="Any graph"
        data={strange ? [...known, { value: filter.graph, label: filter.graph }] : known}
        searchable
        clearable
        comboboxProps={{ withinPortal: false }}
        value={filter.graph || null}
        onChange={(graph) => onChange({ ...filter, graph: graph ?? "", version: "" })}
      />
      <Select
        label="Version"
        placeholder={filter.graph === "" ? "Choose a graph first" : "Any version"}
        disabled={filter.graph === ""}
        data={versions.map(({ id }) => ({ value: id, label: versionName(versions, id) }))}
        clearable
        comboboxProps={{ withinPortal: false }}
        value={filter.version || null}
        onChange={(version) => onChange({ ...filter, version: version ?? "" })}
      />
      <Person filter={filter} onChange={onChange} />
      <TextInput
        type="date"
        label="From"
        value={dateOf(filter.since)}
        onChange={(event) =>
          onChange({ ...filter, since: momentOf(event.currentTarget.value, "begin") })
        }
      />
      <TextInput
        type="date"
        label="To"
        value={dateOf(filter.until)}
        onChange={(event) =>
          onChange({ ...filter, until: momentOf(event.currentTarget.value, "end") })
        }
      />
    </Stack>
  );
}

function MoreRunFilters(props: Props) {
  const { filter } = props;
  const rare = RARE.filter((name) => filter[name] !== NO_FILTER[name]).length;
  const ending = endingOf(filter) === "all" ? 0 : 1;
  return (
    <Popover position="bottom-end" width={280} withinPortal trapFocus>
      <Popover.Target>
        <Button
          variant={rare > 0 ? "light" : "default"}
          leftSection={<IconAdjustmentsHorizontal size={15} aria-hidden />}
          aria-label={rare + ending > 0 ? `Filters, ${rare + ending} set` : "Filters"}
        >
          Filters
          {rare > 0 && <span className={style.wide}> · {rare}</span>}
          {rare + ending > 0 && <span className={style.narrow}> · {rare + ending}</span>}
        </Button>
      </Popover.Target>
      <Popover.Dropdown className="overflow-y-auto" mah="calc(100dvh - 12rem)">
        <Fields {...props} />
      </Popover.Dropdown>
    </Popover>
  );
}
