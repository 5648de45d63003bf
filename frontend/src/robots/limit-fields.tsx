/** The limits of the numbers that are sent to a robot, as an owner writes them. */
import { ActionIcon, Button, NumberInput, Text, TextInput } from "@mantine/core";
import { IconPlus, IconX } from "@tabler/icons-react";
import { useState } from "react";
import { type LimitedTo, limitWords } from "../api/rights";
import { usePendingText } from "../ui/drafts";
import { isolated } from "../words/isolated";
import style from "./limit-fields.module.css";

const EMPTY: LimitedTo = { parameter: "", action: "", least: null, most: null };

/** A limit as it is being written. `key` stays while others are removed. */
export interface DraftLimit extends LimitedTo {
  readonly key: number;
}

/** Return limits with a key each. */
export const draftsOf = (limits: readonly LimitedTo[]): readonly DraftLimit[] =>
  limits.map((limit, key) => ({ ...limit, key }));

/** Return the limits that were written: lines without a parameter are left out. */
export const limitsOf = (drafts: readonly DraftLimit[]): LimitedTo[] =>
  drafts
    .map(({ parameter, action, least, most }) => ({
      parameter: parameter.trim(),
      action: action.trim(),
      least,
      most,
    }))
    .filter(({ parameter }) => parameter !== "");

const bound = (value: number | string) => (typeof value === "number" ? value : null);

interface Props {
  drafts: readonly DraftLimit[];
  onChange: (drafts: readonly DraftLimit[]) => void;
}

export function LimitFields({ drafts, onChange }: Props) {
  const [before] = useState(drafts);
  usePendingText(drafts === before ? "" : JSON.stringify(limitsOf(drafts)), null);
  const put = (key: number, change: Partial<LimitedTo>) =>
    onChange(drafts.map((each) => (each.key === key ? { ...each, ...change } : each)));
  const add = () => {
    const key = Math.max(-1, ...drafts.map((each) => each.key)) + 1;
    onChange([...drafts, { ...EMPTY, key }]);
  };
  return (
    <fieldset className={style.limits}>
      <legend className={style.legend}>Limits of the numbers that are sent there</legend>
      <Text size="xs" c="dimmed">
        Checked before a start and before each action of a led run leaves; such a run is stopped
        then. The robot does not enforce them.
      </Text>
      {drafts.map((each, index) => {
        const name = each.parameter.trim() === "" ? `limit ${index + 1}` : limitWords(each);
        return (
          <div key={each.key} className={style.line}>
            <TextInput
              size="xs"
              label="Parameter"
              placeholder="torque"
              value={each.parameter}
              maxLength={1000}
              onChange={(event) => put(each.key, { parameter: event.currentTarget.value })}
            />
            <TextInput
              size="xs"
              label="Of action"
              placeholder="every"
              value={each.action}
              maxLength={1000}
              onChange={(event) => put(each.key, { action: event.currentTarget.value })}
            />
            <NumberInput
              size="xs"
              label="At least"
              hideControls
              value={each.least ?? ""}
              onChange={(value) => put(each.key, { least: bound(value) })}
            />
            <NumberInput
              size="xs"
              label="At most"
              hideControls
              value={each.most ?? ""}
              onChange={(value) => put(each.key, { most: bound(value) })}
            />
            <ActionIcon
              aria-label={`Remove ${isolated(name)}`}
              onClick={() => onChange(drafts.filter(({ key }) => key !== each.key))}
            >
              <IconX size={15} aria-hidden />
            </ActionIcon>
          </div>
        );
      })}
      <Button size="xs" leftSection={<IconPlus size={14} aria-hidden />} onClick={add}>
        Add a limit
      </Button>
    </fieldset>
  );
}
