/** The rights of a robot where people meet them: its baton, and that it is out of service. */
import { Button, Menu, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconArrowsExchange, IconBarrierBlock, IconSquareFilled } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { errorText } from "../api/http";
import { enginesOf } from "../api/led-runs";
import { openRuns } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMay, usePerson } from "../api/people";
import {
  dropBaton,
  handBaton,
  handOverRun,
  takeBaton,
  unlockRobot,
  useRight,
  useRights,
} from "../api/rights";
import type { Robot } from "../api/robots";
import type { Run } from "../api/runs";
import { usePendingText } from "../ui/drafts";
import { clock, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./robot-rights.module.css";

/** Sends a change of the rights of a robot, and reports why it was refused. */
function useRightsChange(title: string) {
  const { runner } = useLive();
  const { refetch } = useRights();
  return useMutation({
    mutationFn: (change: (runner: string) => Promise<unknown>) => change(runner ?? ""),
    onError: (error) => notifications.show({ color: "red", title, message: errorText(error) }),
    onSettled: () => void refetch(),
  });
}

/** Return the sentence about the baton of a robot; "" for a robot without one. */
export function batonWords(robot: Robot, me: string): string {
  if (!robot.baton) return "";
  if (robot.holder === null) return "Nobody has its baton";
  const { person, here, falls_at } = robot.holder;
  const subject = person.id === me ? "You have" : `${isolated(person.name || "Somebody")} has`;
  const at = instant(falls_at);
  const gone = here || at === null ? "" : `, and no page open: it falls at ${clock(at)}`;
  return `${subject} its baton${gone}`;
}

/** The baton of a robot: who has it, and to take it, hand it over or drop it. */
export function Baton({ robot }: { robot: Robot }) {
  const { person } = usePerson();
  const right = useRight(robot.name);
  const may = useMay("operate");
  if (!robot.baton) return null;
  const holds = robot.holder?.person.id === person.id;
  return (
    <div className={style.baton} data-mine={holds || undefined}>
      <IconArrowsExchange size={15} aria-hidden />
      <span role="status">{batonWords(robot, person.id)}.</span>
      {may && right?.may_take && !holds && <TakeBaton robot={robot} />}
      {holds && <PassBaton robot={robot} />}
    </div>
  );
}

export function TakeBaton({ robot, onTaken }: { robot: Robot; onTaken?: () => void }) {
  const [asks, setAsks] = useState(false);
  const [reason, setReason] = useState("");
  usePendingText(reason, null);
  const change = useRightsChange(`The baton of ${isolated(robot.name)} was not taken`);
  const held = robot.holder !== null;
  const take = () =>
    change.mutate((runner) => takeBaton(runner, robot.name, reason.trim()), {
      onSuccess: () => {
        setAsks(false);
        onTaken?.();
      },
    });
  if (!held || !asks) {
    return (
      <Button
        size="compact-sm"
        loading={change.isPending}
        onClick={() => (held ? setAsks(true) : take())}
      >
        {held ? "Take it over …" : "Take the baton"}
      </Button>
    );
  }
  return (
    <form
      className={style.reason}
      onSubmit={(event) => {
        event.preventDefault();
        take();
      }}
    >
      <TextInput
        size="xs"
        className={style.field ?? ""}
        aria-label={`Why you take over the baton of ${isolated(robot.name)}`}
        placeholder="Why? It is recorded."
        value={reason}
        maxLength={500}
        autoFocus
        onChange={(event) => setReason(event.currentTarget.value)}
      />
      <Button
        type="submit"
        size="compact-sm"
        loading={change.isPending}
        disabled={reason.trim().length < 3}
      >
        Take it over
      </Button>
      <Button size="compact-sm" variant="subtle" onClick={() => setAsks(false)}>
        Cancel
      </Button>
    </form>
  );
}

/** Return the led run that the holder can hand over together with the batons of all of its robots. */
function runToHandOver(robot: Robot, runs: readonly Run[]): Run | undefined {
  return runs.find((run) => run.robots && enginesOf(run).includes(robot.name));
}

function PassBaton({ robot }: { robot: Robot }) {
  const { now } = useLive();
  const { person } = usePerson();
  const people = (useRights().data?.people ?? []).filter((each) => each.id !== person.id);
  const change = useRightsChange(`The baton of ${isolated(robot.name)} was not handed over`);
  const run = runToHandOver(robot, openRuns(now));
  return (
    <Menu>
      <Menu.Target>
        <Button size="compact-sm" loading={change.isPending}>
          Hand over …
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {people.length === 0 && <Menu.Label>No other operator has a page open here</Menu.Label>}
        {people.map(({ id, name }) => (
          <Menu.Item
            key={id}
            onClick={() => change.mutate((runner) => handBaton(runner, robot.name, id))}
          >
            To {isolated(name || "somebody without a name")}
            {run && `: run ${run.number} waits until they let it go on`}
          </Menu.Item>
        ))}
        {run &&
          people.map(({ id, name }) => (
            <Menu.Item
              key={`${id} run`}
              onClick={() => change.mutate((runner) => handOverRun(runner, run.id, id))}
            >
              To {isolated(name || "somebody without a name")} with run {run.number}, which goes on
            </Menu.Item>
          ))}
        <Menu.Divider />
        <Menu.Item onClick={() => change.mutate((runner) => dropBaton(runner, robot.name))}>
          Drop it{run && `: run ${run.number} waits`}
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}

/** Says loudly that a robot is out of service, and that what runs there is not stopped by it. */
export function OutOfService({ robot, stop }: { robot: Robot; stop?: ReactNode }) {
  const { person } = usePerson();
  const isOwner = useMay("share");
  const may = useMay("operate");
  const change = useRightsChange(`${isolated(robot.name)} stays out of service`);
  if (robot.locks.length === 0) return null;
  const mine = robot.locks.filter(({ by }) => may && (isOwner || by.id === person.id));
  return (
    <section className={style.service} aria-label={`${isolated(robot.name)} is out of service`}>
      <IconBarrierBlock size={18} aria-hidden />
      <div className={style.said}>
        <p role="alert">
          <b>{isolated(robot.name)} is OUT OF SERVICE: nothing starts or goes on there.</b>
          {stop !== undefined && " What runs there is not stopped by this."}
        </p>
        {robot.locks.map(({ by, at, reason }) => (
          <p key={by.id}>
            {isolated(by.name || "Somebody")}, {clock(instant(at) ?? 0)}: “{reason}”
          </p>
        ))}
      </div>
      {mine.map(({ by }) => (
        <Button
          key={by.id}
          size="compact-sm"
          loading={change.isPending}
          onClick={() => change.mutate((runner) => unlockRobot(runner, robot.name, by.id))}
        >
          {by.id === person.id
            ? "Take my lock off"
            : `Take the lock of ${isolated(by.name || "somebody")} off`}
        </Button>
      ))}
      {stop}
    </section>
  );
}

/** Shows for a run that goes on which of its robots are out of service, with STOP beside each. */
export function ServiceNotices({ run }: { run: Run }) {
  const { live, now } = useLive();
  if (run.ended_at !== null) return null;
  const engines = enginesOf(run);
  const stop = (
    <Button
      size="compact-sm"
      variant="filled"
      color="red"
      leftSection={<IconSquareFilled size={11} aria-hidden />}
      aria-label={`Stop run ${run.number}`}
      onClick={() => live?.stop(run.id)}
    >
      Stop
    </Button>
  );
  return now.engines
    .filter((robot) => engines.includes(robot.name))
    .map((robot) => <OutOfService key={robot.name} robot={robot} stop={stop} />);
}
