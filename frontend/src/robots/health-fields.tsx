/** The health of a robot that is looked at before a start, as an owner writes it. */
import { Button, Group, NumberInput, Select, Stack, Text, TextInput } from "@mantine/core";
import { IconPlus } from "@tabler/icons-react";
import { useState } from "react";
import type { HealthCheck } from "../api/rights";
import { usePendingText } from "../ui/drafts";
import { isolated } from "../words/isolated";
import style from "./limit-fields.module.css";

const NEW: HealthCheck = {
  topic: "",
  kind: "battery",
  below: 30,
  status: "",
  level: 2,
  age_s: 30,
  poor: "warn",
  unknown: "warn",
};
const KINDS = [
  { value: "battery", label: "Battery" },
  { value: "diagnostics", label: "Diagnostics" },
];
const LEVELS = [
  { value: "1", label: "Warning" },
  { value: "2", label: "Error" },
];
const FOLLOWS = [
  { value: "warn", label: "Warn" },
  { value: "block", label: "Block" },
];

/** A check as it is being written. `key` stays while others are removed. */
export interface DraftCheck extends HealthCheck {
  readonly key: number;
}

/** Return checks with a key each. */
export const checkDraftsOf = (checks: readonly HealthCheck[]): readonly DraftCheck[] =>
  checks.map((check, key) => ({ ...check, key }));

/** Return the checks that were written: those without a topic are left out. */
export const checksOf = (drafts: readonly DraftCheck[]): HealthCheck[] =>
  drafts
    .map(({ key: _, ...check }) => ({ ...check, topic: check.topic.trim() }))
    .filter(({ topic }) => topic !== "");

interface FieldsProps {
  check: DraftCheck;
  name: string;
  onChange: (change: Partial<HealthCheck>) => void;
  onRemove: () => void;
}

interface FollowProps {
  label: string;
  value: HealthCheck["poor"];
  onChange: (value: HealthCheck["poor"]) => void;
}

function Follow({ label, value, onChange }: FollowProps) {
  return (
    <Select
      size="xs"
      label={label}
      allowDeselect={false}
      data={FOLLOWS}
      value={value}
      onChange={(chosen) => onChange(chosen === "block" ? "block" : "warn")}
    />
  );
}

function CheckFields({ check, name, onChange, onRemove }: FieldsProps) {
  const number = (value: string | number, before: number) =>
    typeof value === "number" ? value : before;
  return (
    <Stack gap="xs" w="100%" role="group" aria-label={isolated(name)}>
      <Group grow align="end">
        <Select
          size="xs"
          label="Reported as"
          allowDeselect={false}
          data={KINDS}
          value={check.kind}
          onChange={(kind) => onChange({ kind: kind === "battery" ? "battery" : "diagnostics" })}
        />
        <TextInput
          size="xs"
          label="Topic"
          placeholder={check.kind === "battery" ? "/battery_state" : "/diagnostics"}
          value={check.topic}
          maxLength={200}
          onChange={(event) => onChange({ topic: event.currentTarget.value })}
        />
      </Group>
      <Group grow align="end">
        {check.kind === "diagnostics" && (
          <TextInput
            size="xs"
            label="Status"
            placeholder="David: motors"
            value={check.status}
            maxLength={200}
            onChange={(event) => onChange({ status: event.currentTarget.value })}
          />
        )}
        {check.kind === "diagnostics" ? (
          <Select
            size="xs"
            label="Poor from"
            allowDeselect={false}
            data={LEVELS}
            value={String(check.level)}
            onChange={(value) => onChange({ level: Number(value) })}
          />
        ) : (
          <NumberInput
            size="xs"
            label="Poor below (%)"
            min={1}
            max={100}
            value={check.below}
            onChange={(value) => onChange({ below: number(value, check.below) })}
          />
        )}
        <NumberInput
          size="xs"
          label="Too old after (s)"
          min={0.1}
          max={3600}
          value={check.age_s}
          onChange={(value) => onChange({ age_s: number(value, check.age_s) })}
        />
      </Group>
      <Group grow align="end">
        <Follow
          label="If poor"
          value={check.poor}
          // What blocks when it is poor blocks when it is unknown, too; the other way round a person says so.
          onChange={(poor) => onChange(poor === "block" ? { poor, unknown: poor } : { poor })}
        />
        <Follow
          label="If unknown"
          value={check.unknown}
          onChange={(unknown) => onChange({ unknown })}
        />
        <Button size="xs" aria-label={`Remove ${isolated(name)}`} onClick={onRemove}>
          Remove
        </Button>
      </Group>
    </Stack>
  );
}

interface Props {
  drafts: readonly DraftCheck[];
  onChange: (drafts: readonly DraftCheck[]) => void;
}

export function HealthFields({ drafts, onChange }: Props) {
  const [before] = useState(drafts);
  usePendingText(drafts === before ? "" : JSON.stringify(checksOf(drafts)), null);
  const add = () => {
    const key = Math.max(-1, ...drafts.map((each) => each.key)) + 1;
    onChange([...drafts, { ...NEW, key }]);
  };
  return (
    <fieldset className={style.limits}>
      <legend className={style.legend}>Health that is looked at before a start</legend>
      <Text size="xs" c="dimmed">
        Information, no safety function: it is shown, and asked about at a start. It closes no gate
        and stops nothing; what blocks, blocks a start only. Health is unknown while nothing
        publishes it, the type is another one, the value is not valid, or the message is old.
      </Text>
      {drafts.map((each, index) => (
        <CheckFields
          key={each.key}
          check={each}
          name={each.status || each.topic || `check ${index + 1}`}
          onChange={(change) =>
            onChange(drafts.map((other) => (other === each ? { ...each, ...change } : other)))
          }
          onRemove={() => onChange(drafts.filter(({ key }) => key !== each.key))}
        />
      ))}
      <Button size="xs" leftSection={<IconPlus size={14} aria-hidden />} onClick={add}>
        Add a check
      </Button>
    </fieldset>
  );
}
