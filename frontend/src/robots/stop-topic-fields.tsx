/** Fields in which an owner says where a robot reports its hardware stop. */
import {
  Group,
  NumberInput,
  SegmentedControl,
  Select,
  Stack,
  Switch,
  TextInput,
} from "@mantine/core";
import { useState } from "react";
import type { ReportedStop } from "../api/rights";
import { usePendingText } from "../ui/drafts";

const NEW: ReportedStop = {
  topic: "",
  kind: "bool",
  age_s: 1,
  pressed: true,
  status: "",
  level: 2,
};
const LEVELS = [
  { value: "1", label: "Warning or above" },
  { value: "2", label: "Error or above" },
  { value: "3", label: "Stale" },
];

interface Props {
  stop: ReportedStop | null;
  onChange: (stop: ReportedStop | null) => void;
}

export function StopTopicFields({ stop, onChange }: Props) {
  const [before] = useState(stop);
  usePendingText(stop === before || stop === null ? "" : stop.topic + stop.status, null);
  const put = (change: Partial<ReportedStop>) => onChange({ ...(stop ?? NEW), ...change });
  return (
    <Stack gap="xs">
      <Switch
        label="The robot reports whether its hardware stop is pressed"
        description="Information, no safety function. While it is pressed nothing starts there and what runs is stopped; a release starts nothing. No publisher, another type or an old message count as pressed."
        checked={stop !== null}
        onChange={(event) => onChange(event.currentTarget.checked ? NEW : null)}
      />
      {stop !== null && (
        <>
          <Group grow align="end">
            <TextInput
              size="xs"
              label="Topic"
              placeholder="/estop"
              value={stop.topic}
              maxLength={200}
              onChange={(event) => put({ topic: event.currentTarget.value })}
            />
            <NumberInput
              size="xs"
              label="Longest age of a message (s)"
              min={0.1}
              max={3600}
              value={stop.age_s}
              onChange={(value) => put({ age_s: typeof value === "number" ? value : 1 })}
            />
          </Group>
          <SegmentedControl
            size="xs"
            fullWidth
            aria-label="Type of its messages"
            value={stop.kind}
            onChange={(kind) => put({ kind: kind === "bool" ? "bool" : "diagnostics" })}
            data={[
              { value: "bool", label: "std_msgs/Bool" },
              { value: "diagnostics", label: "DiagnosticArray" },
            ]}
          />
          {stop.kind === "bool" ? (
            <Select
              size="xs"
              label="Pressed is"
              allowDeselect={false}
              data={["true", "false"]}
              value={String(stop.pressed)}
              onChange={(value) => put({ pressed: value === "true" })}
            />
          ) : (
            <Group grow align="end">
              <TextInput
                size="xs"
                label="Name of the status"
                placeholder="David: stop"
                required
                value={stop.status}
                maxLength={200}
                onChange={(event) => put({ status: event.currentTarget.value })}
              />
              <Select
                size="xs"
                label="Pressed from"
                allowDeselect={false}
                data={LEVELS}
                value={String(stop.level)}
                onChange={(value) => put({ level: Number(value) })}
              />
            </Group>
          )}
        </>
      )}
    </Stack>
  );
}
