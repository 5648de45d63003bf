/** One robot: its engine in words, what makes answers a proof, what runs there. */

import { ActionIcon, Button, Menu, Tabs, Text } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconAlertTriangle,
  IconBarrierBlock,
  IconCheck,
  IconDots,
  IconHandStop,
  IconPencil,
  IconSquareFilled,
  IconTrash,
  IconUserCheck,
} from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { errorText } from "../api/http";
import { useLive, useRobotAnsweredAt } from "../api/page-link";
import { useMay } from "../api/people";
import { pageWords, useRight } from "../api/rights";
import {
  forgetRobot,
  type Registration,
  type Robot,
  stopRobot,
  useIndexedByRobot,
} from "../api/robots";
import { shiftOfRobot } from "../api/site-places";
import { Baton, OutOfService } from "../status/robot-rights";
import { EngineLabel } from "../status/state-label";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { colorOfName } from "../ui/name-colors";
import { ago, clock, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import { Drills } from "./drills";
import style from "./robot-card.module.css";
import { RobotLog } from "./robot-log";
import { notifyRobotFailure, RobotRuns } from "./robot-runs";

const RightsForm = lazyPart(() => import("./rights-form").then((part) => part.RightsForm));
const DrillForm = lazyPart(() => import("./drill-form").then((part) => part.DrillForm));
const LockForm = lazyPart(() => import("./rights-form").then((part) => part.LockForm));

interface Props {
  robot: Robot;
  onEdit: (robot: Registration) => void;
  onImport: (text: string, name: string) => void;
  /** Restarts a practice robot that is gone. */
  restartControl?: ReactNode;
}

type Sign = { good: boolean; text: string; age?: string };

/** Return the warnings that a person should know before trusting a robot or starting a run. */
function robotSigns(robot: Robot, now: number): Sign[] {
  if (robot.state === "no_link") return [];
  const signs: Sign[] = [];
  if (robot.servers === 1)
    signs.push({ good: true, text: "A stop can be proven: one engine answers on its path" });
  if (robot.servers > 1) {
    const text = `${robot.servers} engines answer on one path: nothing they say proves a stop`;
    signs.push({ good: false, text });
  }
  if (robot.generation === "current")
    signs.push({ good: true, text: "Speaks the current messages" });
  if (robot.generation === "older") {
    signs.push({ good: false, text: "Speaks an older generation of messages: it cannot be used" });
  }
  if (robot.led) {
    const text = "Led step by step: a run may start further actions on it until it ends";
    signs.push({ good: true, text });
  }
  if (robot.hardware_stop !== null) {
    const text = robot.pressed
      ? `${robot.pressed} What others start there meanwhile is not stopped from here.`
      : "Its hardware stop is not pressed, as it reports";
    signs.push({ good: robot.pressed === "", text });
  }
  for (const { state, text, topic, heard_at } of robot.health) {
    const at = instant(heard_at);
    const age = at === null ? "" : `, ${ago(at, now)}`;
    signs.push({ good: state === "fine", text: `${text}: ${isolated(topic)}`, age });
  }
  if (robot.page_presence !== null) {
    const text = `A page has to stay visible: ${pageWords(robot.page_presence)}`;
    signs.push({ good: true, text });
  }
  if (robot.others > 0) {
    const who = robot.others === 1 ? "1 other program" : `${robot.others} other programs`;
    signs.push({ good: false, text: `${isolated(who)} can also start graphs on it` });
  }
  if (robot.actor !== "" && robot.actor !== robot.name) {
    signs.push({ good: false, text: `Its feedback has another name: ${robot.actor}` });
  }
  return signs;
}

function Signs({ robot }: { robot: Robot }) {
  const now = useNow(1000) - shiftOfRobot(robot.name);
  return (
    <ul className={style.signs}>
      {robotSigns(robot, now).map(({ good, text, age = "" }) => (
        <li className="inline-row gap-30" key={text} data-good={good || undefined}>
          {good ? <IconCheck size={14} aria-hidden /> : <IconAlertTriangle size={14} aria-hidden />}{" "}
          {text}
          {age}
        </li>
      ))}
    </ul>
  );
}

function Facts({ robot }: { robot: Robot }) {
  const now = useNow(1000);
  const at = instant(robot.heard_at);
  const heard =
    useRobotAnsweredAt(robot.name) ?? (at === null ? null : at + shiftOfRobot(robot.name));
  const restarted = instant(robot.restarted_at);
  const took = robot.took_ms === null ? "" : ` within ${Math.max(1, Math.round(robot.took_ms))} ms`;
  return (
    <p className="m-0 quiet-xs tabular">
      domain {robot.domain} · <code>{robot.get_service}</code>
      {robot.rmw !== "" && ` · ${robot.rmw}`} ·{" "}
      {heard === null ? "never answered" : `answered ${ago(heard, now)}${took}`}
      {restarted !== null && ` · restarted ${clock(restarted)}`}
    </p>
  );
}

function More({ robot, onEdit }: Pick<Props, "robot" | "onEdit">) {
  const { runner } = useLive();
  const client = useQueryClient();
  const may = useMay("register");
  const isOwner = useMay("share");
  const [asks, setAsks] = useState<"rights" | "lock" | "drill" | null>(null);
  const close = () => setAsks(null);
  const forget = async () => {
    try {
      await forgetRobot(runner ?? "", robot.name);
      await client.invalidateQueries({ queryKey: ["robots"] });
    } catch (error) {
      const title = `${isolated(robot.name)} was not forgotten`;
      notifications.show({ color: "red", title, message: errorText(error) });
    }
  };
  return (
    <>
      <OverlayBoundary>
        {asks === "rights" && <RightsForm robot={robot} onClose={close} />}
        {asks === "lock" && <LockForm robot={robot} onClose={close} />}
        {asks === "drill" && <DrillForm robot={robot} onClose={close} />}
      </OverlayBoundary>
      <Menu>
        <Menu.Target>
          <ActionIcon size={32} aria-label={`More about ${isolated(robot.name)}`}>
            <IconDots size={17} aria-hidden />
          </ActionIcon>
        </Menu.Target>
        <Menu.Dropdown>
          {!may && <Menu.Label>Operators register robots</Menu.Label>}
          <Menu.Item
            leftSection={<IconPencil size={15} />}
            disabled={!may}
            onClick={() =>
              onEdit({
                name: robot.name,
                domain: robot.domain ?? 0,
                rmw: robot.rmw,
                get_service: robot.get_service,
                profile: robot.profile,
                led: robot.led,
              })
            }
          >
            Change …
          </Menu.Item>
          <Menu.Item
            leftSection={<IconUserCheck size={15} />}
            disabled={!isOwner}
            onClick={() => setAsks("rights")}
          >
            Who may start here …{!isOwner && " (owners)"}
          </Menu.Item>
          <Menu.Item
            leftSection={<IconHandStop size={15} />}
            disabled={!may}
            onClick={() => setAsks("drill")}
          >
            Record a Stop drill …
          </Menu.Item>
          <Menu.Item
            leftSection={<IconBarrierBlock size={15} />}
            disabled={!may}
            onClick={() => setAsks("lock")}
          >
            Put out of service …
          </Menu.Item>
          <Menu.Item
            c="var(--error)"
            leftSection={<IconTrash size={15} />}
            disabled={!may}
            onClick={() => void forget()}
          >
            Forget
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
    </>
  );
}

/** The reason why the signed-in person may not start here, in the words of the runner. */
function WhyNot({ robot }: { robot: Robot }) {
  const why = useRight(robot.name)?.why ?? "";
  const may = useMay("operate");
  if (why === "" || !may || robot.locks.length > 0) return null;
  return <p className={style.why}>{why}</p>;
}

function StopHere({ robot }: { robot: Robot }) {
  const { runner } = useLive();
  const stop = () =>
    stopRobot(runner ?? "", robot.name).catch((error: unknown) =>
      notifyRobotFailure(`NOT SENT: use the hardware stop of ${isolated(robot.name)}`, error),
    );
  return (
    <Button
      size="compact-sm"
      variant="filled"
      color="red"
      leftSection={<IconSquareFilled size={11} aria-hidden />}
      aria-label={`Stop what runs on ${isolated(robot.name)}`}
      onClick={() => void stop()}
    >
      Stop
    </Button>
  );
}

export function RobotCard({ robot, onEdit, onImport, restartControl }: Props) {
  const [open, setOpen] = useState<string | null>(null);
  const linked = robot.state !== "no_link";
  const count = (n: number | null, what: string) =>
    n === null ? `${what}s` : `${n} ${what}${n === 1 ? "" : "s"}`;
  return (
    <article className={style.card} aria-label={robot.name}>
      <i className={style.stripe} style={{ background: colorOfName(robot.name) }} aria-hidden />
      <header className="row gap-60">
        <h3 className={style.name}>{robot.name}</h3>
        <EngineLabel robot={robot} />
        <span className="flex-1" />
        <More robot={robot} onEdit={onEdit} />
      </header>
      <OutOfService robot={robot} stop={<StopHere robot={robot} />} />
      <Facts robot={robot} />
      <Baton robot={robot} />
      <Drills robot={robot} />
      <WhyNot robot={robot} />
      {robot.why !== "" && <p className={style.why}>{robot.why}</p>}
      {restartControl}
      <Signs robot={robot} />
      <RobotRuns robot={robot} onImport={onImport} />
      {linked && (
        <Tabs value={open} onChange={setOpen} className={style.tabs ?? ""} keepMounted={false}>
          <Tabs.List>
            <Tabs.Tab value="known">
              {robot.actions === null && robot.graphs === null
                ? "Actions and graphs"
                : `${count(robot.actions, "action")}, ${count(robot.graphs, "graph")}`}
            </Tabs.Tab>
            <Tabs.Tab value="flight">What others told it</Tabs.Tab>
            {open !== null && (
              <Button
                size="compact-xs"
                variant="subtle"
                ml="auto"
                my="auto"
                onClick={() => setOpen(null)}
              >
                Close
              </Button>
            )}
          </Tabs.List>
          <Tabs.Panel value="known" className={style.panel ?? ""}>
            <IndexedActions robot={robot.name} />
          </Tabs.Panel>
          <Tabs.Panel value="flight" className={style.panel ?? ""}>
            <RobotLog robot={robot.name} onImport={onImport} />
          </Tabs.Panel>
        </Tabs>
      )}
    </article>
  );
}

function parameters(inputs: Record<string, string>): string {
  return Object.entries(inputs)
    .map(([name, type]) => `${isolated(name)}: ${type}`)
    .join(", ");
}

function IndexedActions({ robot }: { robot: string }) {
  const { runner } = useLive();
  const known = useIndexedByRobot(runner, robot);
  if (known.isPending) return <Text c="dimmed">Reading …</Text>;
  if (known.isError) return <Text c="var(--error)">Its index cannot be read now.</Text>;
  const { actions, graphs, unread } = known.data;
  return (
    <>
      {actions.length === 0 && <Text c="dimmed">It reports no actions.</Text>}
      <ul className={style.list}>
        {actions.map(({ name, inputs, outputs }) => (
          <li key={name}>
            <b>{name}</b> <span className="quiet-xs">({parameters(inputs)})</span>
            {Object.keys(outputs).length > 0 && (
              <span className="quiet-xs"> → {parameters(outputs)}</span>
            )}
          </li>
        ))}
      </ul>
      {graphs.length > 0 && (
        <p className={style.graphs}>
          Graphs of its own: <b>{graphs.map(isolated).join(", ")}</b>
        </p>
      )}
      {unread > 0 && <Text c="var(--warn)">{unread} of its files cannot be read.</Text>}
    </>
  );
}
