/** An owner says who may start on a robot, whether it has a baton, and what each start there needs. */
import {
  ActionIcon,
  Button,
  Group,
  Modal,
  NumberInput,
  SegmentedControl,
  Select,
  Stack,
  Switch,
  Text,
  TextInput,
} from "@mantine/core";
import { IconX } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { NAMELESS } from "../api/people";
import { type AllowedOperator, lockRobot, setRights, useEntitled } from "../api/rights";
import type { Robot } from "../api/robots";
import { usePendingText } from "../ui/drafts";
import { isolated } from "../words/isolated";
import { checkDraftsOf, checksOf, HealthFields } from "./health-fields";
import { draftsOf, LimitFields, limitsOf } from "./limit-fields";
import { PagePresenceFields } from "./page-presence-fields";
import style from "./rights-form.module.css";
import { StopTopicFields } from "./stop-topic-fields";

const NOBODY: readonly AllowedOperator[] = [];
const MONTH = 30;

/** Return the last day of a right as a date field has it; "" for one that does not end. */
export function lastDay(until: string | null): string {
  if (until === null) return "";
  const end = new Date(Date.parse(until) - 1);
  const two = (n: number) => String(n).padStart(2, "0");
  return `${end.getFullYear()}-${two(end.getMonth() + 1)}-${two(end.getDate())}`;
}

/** Return the moment at which a right ends whose last day is this one; null for none. */
export function endOfDay(day: string): string | null {
  const [year, month, date] = day.split("-").map(Number);
  if (year === undefined || month === undefined || date === undefined) return null;
  return new Date(year, month - 1, date + 1).toISOString();
}

function Operators(props: {
  chosen: readonly AllowedOperator[];
  onChange: (chosen: AllowedOperator[]) => void;
}) {
  const { chosen, onChange } = props;
  const { groups, people } = useEntitled();
  const isLeft = ({ id }: { id: string }) => !chosen.some((each) => each.id === id);
  const left = [...groups, ...people].filter(isLeft);
  const items = (all: typeof left) =>
    all.filter(isLeft).map(({ id, name }) => ({ value: id, label: isolated(name || id) }));
  const put = (changed: AllowedOperator) =>
    onChange(chosen.map((each) => (each.id === changed.id ? changed : each)));
  return (
    <>
      <ul className="list-reset" aria-label="Who may start there">
        {chosen.map((each) => (
          <li key={each.id} className={style.line}>
            <span className="ellipsis weight-550 flex-1">{isolated(each.name || NAMELESS)}</span>
            <TextInput
              size="xs"
              type="date"
              aria-label={`Last day of ${isolated(each.name || NAMELESS)}`}
              value={lastDay(each.until)}
              onChange={(event) => put({ ...each, until: endOfDay(event.currentTarget.value) })}
            />
            <ActionIcon
              aria-label={`Remove ${isolated(each.name || NAMELESS)}`}
              onClick={() => onChange(chosen.filter(({ id }) => id !== each.id))}
            >
              <IconX size={15} aria-hidden />
            </ActionIcon>
          </li>
        ))}
      </ul>
      <Select
        label="Add a person or a group"
        placeholder={left.length === 0 ? "Nobody else has been here" : "Choose"}
        data={[
          { group: "Groups", items: items([...groups]) },
          { group: "People", items: items([...people]) },
        ]}
        value={null}
        searchable
        onChange={(id) => {
          const found = left.find((each) => each.id === id);
          if (found) onChange([...chosen, { id: found.id, name: found.name, until: null }]);
        }}
      />
    </>
  );
}

export function RightsForm({ robot, onClose }: { robot: Robot; onClose: () => void }) {
  const { runner } = useLive();
  const client = useQueryClient();
  const [all, setAll] = useState(robot.operators === "all");
  const [chosen, setChosen] = useState<readonly AllowedOperator[]>(
    robot.operators === "all" ? NOBODY : robot.operators,
  );
  const [baton, setBaton] = useState(robot.baton);
  const [askAgain, setAskAgain] = useState<number | string>(robot.ask_again || "");
  const [watched, setWatched] = useState(robot.watched);
  const [days, setDays] = useState<number | null>(robot.drill_days);
  const [releasedOnly, setReleasedOnly] = useState(robot.released_only);
  const [stop, setStop] = useState(robot.hardware_stop);
  const [page, setPage] = useState(robot.page_presence);
  const [health, setHealth] = useState(() => checkDraftsOf(robot.health_checks));
  const [limits, setLimits] = useState(() => draftsOf(robot.limits));
  usePendingText(
    chosen === robot.operators || chosen === NOBODY ? "" : JSON.stringify(chosen),
    null,
  );
  const save = useMutation({
    mutationFn: async () => {
      const operators = all ? ("all" as const) : [...chosen];
      await setRights(runner ?? "", robot.name, {
        operators,
        baton,
        watched,
        drill_days: days,
        released_only: releasedOnly,
        ask_again: Number(askAgain) || 0,
        limits: limitsOf(limits),
        hardware_stop: stop,
        page_presence: page,
        health: checksOf(health),
      });
      await client.invalidateQueries({ queryKey: ["robots"] });
    },
    onSuccess: onClose,
  });
  return (
    <Modal
      opened
      onClose={onClose}
      title={`Who may start on ${isolated(robot.name)}`}
      closeButtonProps={{ "aria-label": "Close" }}
    >
      <form
        onSubmit={(event) => {
          event.preventDefault();
          save.mutate();
        }}
      >
        <Stack gap="md">
          <SegmentedControl
            fullWidth
            value={all ? "all" : "some"}
            onChange={(value) => setAll(value === "all")}
            data={[
              { value: "all", label: "Every operator" },
              { value: "some", label: "Only these" },
            ]}
          />
          {!all && <Operators chosen={chosen} onChange={setChosen} />}
          {!all && (
            <Text size="sm" c="dimmed">
              The list counts for owners too. A last day, such as that of a briefing, ends the
              right. Everybody can always press Stop.
            </Text>
          )}
          <Switch
            label="It has a baton"
            description="Only the person who holds it starts there, goes on and resumes. If the baton changes hands, led runs wait for its new holder."
            checked={baton}
            onChange={(event) => setBaton(event.currentTarget.checked)}
          />
          <Switch
            label="Whoever starts there confirms that they watch the robot"
            description="Before each start the person ticks a box: they watch the robot, and its hardware stop is within their reach."
            checked={watched}
            onChange={(event) => setWatched(event.currentTarget.checked)}
          />
          <Switch
            label="Only released versions"
            description="Owners release a version in the history of its graph."
            checked={releasedOnly}
            onChange={(event) => setReleasedOnly(event.currentTarget.checked)}
          />
          <Switch
            label="Stop drills"
            description="Nothing starts there, except for a drill, unless the last one passed and is not too old."
            checked={days !== null}
            onChange={(event) => setDays(event.currentTarget.checked ? MONTH : null)}
          />
          {days !== null && (
            <NumberInput
              label="A drill counts for so many days"
              value={days}
              min={1}
              max={3650}
              allowDecimal={false}
              clampBehavior="strict"
              onChange={(value) => setDays(typeof value === "number" && value >= 1 ? value : 1)}
            />
          )}
          <NumberInput
            label="Ask again who starts, after so many minutes"
            description="Whoever starts there confirms on another device of theirs, or with a passkey, that it is they. Programs cannot start there then. Empty: nobody is asked."
            min={0}
            max={1440}
            allowDecimal={false}
            value={askAgain}
            onChange={setAskAgain}
          />
          <PagePresenceFields page={page} onChange={setPage} />
          <StopTopicFields stop={stop} onChange={setStop} />
          <HealthFields drafts={health} onChange={setHealth} />
          <LimitFields drafts={limits} onChange={setLimits} />
          {save.isError && (
            <Text c="var(--error)" role="alert">
              {errorText(save.error)}
            </Text>
          )}
          <Group justify="flex-end">
            <Button onClick={onClose}>Cancel</Button>
            <Button type="submit" variant="filled" loading={save.isPending}>
              Save
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  );
}

/** Asks why a robot is put out of service. */
export function LockForm({ robot, onClose }: { robot: Robot; onClose: () => void }) {
  const { runner } = useLive();
  const [reason, setReason] = useState("");
  usePendingText(reason, null);
  const lock = useMutation({
    mutationFn: () => lockRobot(runner ?? "", robot.name, reason.trim()),
    onSuccess: onClose,
  });
  return (
    <Modal
      opened
      onClose={onClose}
      title={`Put ${isolated(robot.name)} out of service`}
      closeButtonProps={{ "aria-label": "Close" }}
    >
      <form
        onSubmit={(event) => {
          event.preventDefault();
          lock.mutate();
        }}
      >
        <Stack gap="md">
          <Text size="sm">
            Nothing starts or goes on there until you or an owner take the lock off.{" "}
            <b>What runs there now is not stopped by this: press Stop for that.</b>
          </Text>
          <TextInput
            label="Why"
            placeholder="It leaks oil"
            value={reason}
            maxLength={500}
            data-autofocus
            onChange={(event) => setReason(event.currentTarget.value)}
          />
          {lock.isError && (
            <Text c="var(--error)" role="alert">
              {errorText(lock.error)}
            </Text>
          )}
          <Group justify="flex-end">
            <Button onClick={onClose}>Cancel</Button>
            <Button
              type="submit"
              variant="filled"
              color="red"
              loading={lock.isPending}
              disabled={reason.trim().length < 3}
            >
              Put out of service
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  );
}
