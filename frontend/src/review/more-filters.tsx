/** The rarer filters of runs: graph, version, person and time. */
import { Button, Popover, Select, Stack, TextInput } from "@mantine/core";
import { IconAdjustmentsHorizontal } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { useGraphs, useVersions, versionName } from "../api/graphs";
import type { RunFilter } from "../api/review";
import { keyOf } from "../ui/keys";

interface Props {
  filter: RunFilter;
  onChange: (filter: RunFilter) => void;
}

const RARE = ["graph", "version", "person", "since", "until"] as const;

/** Midnight here, as the runner takes times; empty for none. */
function momentOf(date: string, after: "begin" | "end"): string {
  const day = new Date(`${date}T00:00:00`);
  if (date === "" || Number.isNaN(day.getTime())) return "";
  if (after === "end") day.setDate(day.getDate() + 1);
  return new Date(day.getTime() - (after === "end" ? 1 : 0)).toISOString();
}

/** The day of a moment, as date fields take it. */
export function dateOf(moment: string): string {
  const at = new Date(moment);
  if (moment === "" || Number.isNaN(at.getTime())) return "";
  const two = (n: number) => String(n).padStart(2, "0");
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
}

function Person({ filter, onChange }: Props) {
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

function Fields({ filter, onChange }: Props) {
  const graphs = useGraphs().data ?? [];
  const versions = useVersions(filter.graph).data ?? [];
  const known = graphs.map(({ id, name }) => ({ value: id, label: name }));
  const strange = filter.graph !== "" && known.every(({ value }) => value !== filter.graph);
  return (
    <Stack gap="xs" tabIndex={-1} data-autofocus aria-label="More filters">
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

export function MoreRunFilters(props: Props) {
  const set = RARE.filter((name) => props.filter[name] !== "").length;
  return (
    <Popover position="bottom-end" width={260} withinPortal trapFocus>
      <Popover.Target>
        <Button
          variant={set > 0 ? "light" : "default"}
          leftSection={<IconAdjustmentsHorizontal size={15} aria-hidden />}
          aria-label={set > 0 ? `More filters, ${set} set` : "More filters"}
        >
          More{set > 0 && ` · ${set}`}
        </Button>
      </Popover.Target>
      <Popover.Dropdown>
        <Fields {...props} />
      </Popover.Dropdown>
    </Popover>
  );
}
