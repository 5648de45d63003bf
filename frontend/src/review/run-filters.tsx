/** Which runs the list shows: search, choices, and filters that somebody saved on this device. */
import { ActionIcon, Button, Menu, Select, TextInput } from "@mantine/core";
import { useDebouncedCallback, useLocalStorage } from "@mantine/hooks";
import { IconFilter, IconPin, IconSearch, IconTrash } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { filterOf, NO_FILTER, queryOf, type RunFilter, useLabels } from "../api/review";
import { Segments } from "../ui/segments";
import { isolated } from "../words/isolated";
import { dateOf, MoreRunFilters } from "./more-filters";
import style from "./runs-page.module.css";

type Ending = Pick<RunFilter, "state" | "failed">;

/** How runs stand, by what people ask for. */
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

/** What a filter asks for, in words; the name under which it is saved unless another is given. */
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

function SavedFilters({ filter, onChange }: Pick<Props, "filter" | "onChange">) {
  const [saved, setSaved] = useLocalStorage<SavedFilter[]>({
    key: "aa.run-filters",
    defaultValue: [],
  });
  const query = queryOf(filter).toString();
  const known = saved.some((each) => each.query === query);
  return (
    <Menu position="bottom-end" withinPortal>
      <Menu.Target>
        <Button variant="default" leftSection={<IconFilter size={15} aria-hidden />}>
          Saved
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {saved.map((each) => (
          <div key={each.query} className={style.savedFilter}>
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

export function RunFilters({ runner, filter, onChange, engines }: Props) {
  const labels = useLabels(runner).data ?? [];
  const [text, setText] = useState(filter.text);
  useEffect(() => setText(filter.text), [filter.text]);
  const search = useDebouncedCallback((next: string) => onChange({ ...filter, text: next }), 250);
  return (
    <div className={style.filters}>
      <TextInput
        aria-label="Search runs"
        placeholder="Graph, person, number or message"
        leftSection={<IconSearch size={15} aria-hidden />}
        value={text}
        onChange={(event) => {
          setText(event.currentTarget.value);
          search(event.currentTarget.value.trim());
        }}
        className={style.search ?? ""}
      />
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
      <Select
        aria-label="Robot"
        placeholder="Any robot"
        data={[...engines]}
        clearable
        value={filter.robot || null}
        onChange={(robot) => onChange({ ...filter, robot: robot ?? "" })}
        className={style.choice ?? ""}
      />
      <Select
        aria-label="Label"
        placeholder="Any label"
        data={labels}
        clearable
        searchable
        value={filter.label || null}
        onChange={(label) => onChange({ ...filter, label: label ?? "" })}
        className={style.choice ?? ""}
      />
      <ActionIcon
        variant={filter.pinned ? "filled" : "default"}
        size={34}
        aria-label="Only pinned runs"
        aria-pressed={filter.pinned}
        onClick={() => onChange({ ...filter, pinned: !filter.pinned })}
      >
        <IconPin size={16} aria-hidden />
      </ActionIcon>
      <MoreRunFilters filter={filter} onChange={onChange} />
      <SavedFilters filter={filter} onChange={onChange} />
    </div>
  );
}
