/** The queue: which starts wait for which robots, why and in which order; at its turn a person looks and starts one. */
import { Button, Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconHourglassEmpty } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { Link } from "wouter";
import { errorText } from "../api/http";
import { useMissingSites } from "../api/missing-sites";
import { useLive } from "../api/page-link";
import { useMay, usePerson } from "../api/people";
import {
  closeQueue,
  moveEntry,
  openQueue,
  type Queue,
  type QueueEntry,
  type RobotQueue,
  removeEntry,
  useQueue,
} from "../api/queue";
import { SilentSites } from "../status/silent-sites";
import { lineWords, valueLines } from "../status/value-words";
import { Empty } from "../ui/empty";
import { clock, day, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./queue-page.module.css";
import { Fault, named, Turn } from "./queue-turn";
import type { RunBarParts } from "./run-page";

const robotWords = (robot: string): string =>
  robot === "simulator" ? "the simulator" : isolated(robot);

/** Runs a command on the queue, whose answer is the queue as it is then. */
function useCommand<T>(command: (runner: string) => Promise<T>) {
  const { runner } = useLive();
  const client = useQueryClient();
  return useMutation({
    mutationFn: async () => {
      if (runner === undefined) throw new Error("The address of the runner is not known yet.");
      return command(runner);
    },
    onSettled: () => client.invalidateQueries({ queryKey: ["queue"] }),
  });
}

/** The queue of one robot, where it is closed: why, and the button that opens it. */
function Closed({ queue: { robot, closed } }: { queue: RobotQueue }) {
  const may = useMay(robot === "simulator" ? "simulate" : "operate");
  const open = useCommand((runner) => openQueue(runner, robot, closed?.closing ?? ""));
  if (closed === null) return null;
  return (
    <section className={style.closed} aria-label={`The queue of ${robotWords(robot)}`}>
      <p className="m-0">
        <b>The queue of {robotWords(robot)} is closed.</b> {closed.text} Nothing of it starts until
        a person has looked.
      </p>
      {may && (
        <Button
          size="compact-sm"
          variant="default"
          loading={open.isPending}
          onClick={() => open.mutate()}
        >
          Look again, and open it
        </Button>
      )}
      <Fault error={open.error} />
    </section>
  );
}

/** Closes the queue of a robot that is open. */
function CloseButton({ robot }: { robot: string }) {
  const close = useCommand((runner) => closeQueue(runner, robot));
  return (
    <>
      <Button
        size="compact-sm"
        variant="subtle"
        loading={close.isPending}
        onClick={() => close.mutate()}
      >
        Close the queue of {robotWords(robot)}
      </Button>
      <Fault error={close.error} />
    </>
  );
}

function stateWords({ state, waits, by_itself, obstacle }: QueueEntry): string {
  if (obstacle) return obstacle;
  if (state === "closed") {
    const closed = waits.filter(({ why }) => why === "closed");
    return closed.map(({ robot }) => `The queue of ${robotWords(robot)} is closed.`).join(" ");
  }
  if (waits.length > 0) return waits.map(({ text }) => text).join(" ");
  if (state === "changed") return "Its turn. Something has changed: look before the start.";
  return by_itself ? "Its turn: it starts by itself." : "Its turn: a person looks, and starts it.";
}

interface LineProps {
  entry: QueueEntry;
  place: number;
  /** The entries before and after it. */
  before: QueueEntry | undefined;
  afterNext: QueueEntry | undefined;
  isLast: boolean;
}

function Line({ entry, place, before, afterNext, isLast }: LineProps) {
  const { person } = usePerson();
  const mayStart = useMay(entry.robots.length > 0 ? "operate" : "simulate");
  const now = useNow(60_000);
  const up = useCommand((runner) => moveEntry(runner, entry.id, before?.id ?? ""));
  const down = useCommand((runner) => moveEntry(runner, entry.id, afterNext?.id ?? ""));
  const remove = useCommand((runner) => removeEntry(runner, entry.id));
  const at = instant(entry.entered_at) ?? 0;
  const isOwner = person.role === "owner";
  const isOwn = isOwner || entry.author.id === person.id;
  const mayRise = before !== undefined && (isOwner || before.author.id === person.id);
  const values = valueLines(entry.values).map((line) => isolated(lineWords(line)));
  return (
    <li className={style.entry} data-state={entry.state}>
      <div className={style.head}>
        <span className="ink3">{place}</span>
        <b className="fill">
          <bdi>{entry.graph_name}</bdi> {entry.engine !== "" && named(entry)}
        </b>
        <span className="quiet-12">
          <bdi>{entry.author.name}</bdi>, {day(at, now)} {clock(at)}
        </span>
      </div>
      {values.length > 0 && <p className="m-0 quiet-12">With {values.join(", ")}.</p>}
      <p className={style.state}>{stateWords(entry)}</p>
      {entry.waits.length === 0 && !entry.obstacle && mayStart && !entry.hidden && (
        <Turn entry={entry} />
      )}
      {isOwn && (
        <div className={style.buttons}>
          {mayRise && (
            <Button size="compact-xs" variant="subtle" onClick={() => up.mutate()}>
              Move up
            </Button>
          )}
          {!isLast && (
            <Button size="compact-xs" variant="subtle" onClick={() => down.mutate()}>
              Move down
            </Button>
          )}
          <Button
            size="compact-xs"
            variant="subtle"
            loading={remove.isPending}
            onClick={() => remove.mutate()}
          >
            Remove
          </Button>
        </div>
      )}
      <Fault error={up.error ?? down.error ?? remove.error} />
    </li>
  );
}

function Found({ queue: { entries, robots } }: { queue: Queue }) {
  const isWhole = useMissingSites("get /api/queue").length === 0;
  if (entries.length === 0)
    return !isWhole ? null : (
      <Empty icon={<IconHourglassEmpty size={22} />} title="Nothing waits">
        Where a robot is busy or others wait for it, <b>Wait in the queue</b> stands beside the
        start.
      </Empty>
    );
  return (
    <>
      {robots.map((each) => (
        <Closed key={each.robot} queue={each} />
      ))}
      <ol className={style.list}>
        {entries.map((entry, index) => (
          <Line
            key={entry.id}
            entry={entry}
            place={index + 1}
            before={entries[index - 1]}
            afterNext={entries[index + 2]}
            isLast={index === entries.length - 1}
          />
        ))}
      </ol>
      <p className="quiet-12">
        On a robot nothing starts by itself. Every Stop, and every doubt about a robot, closes its
        queue.
      </p>
      <div className={style.buttons}>
        {robots
          .filter(({ closed }) => closed === null)
          .map(({ robot }) => (
            <CloseButton key={robot} robot={robot} />
          ))}
      </div>
    </>
  );
}

/** Links to the queue, with how much waits there; shows nothing while nothing does. */
export function QueueLink() {
  const { number = 0, yours = 0 } = useLive().now.queue ?? {};
  if (number === 0) return null;
  const turn = yours > 0 ? ": it is your turn" : "";
  return (
    <Button
      component={Link}
      to="/runs/queue"
      size="compact-sm"
      variant={yours > 0 ? "light" : "subtle"}
    >
      {`${counted(number, "start")} in the queue${turn}`}
    </Button>
  );
}

export function QueuePage({ bar }: { bar: (parts: RunBarParts) => ReactNode }) {
  const found = useQueue();
  return (
    <>
      {bar({ crumbs: [{ label: "Runs", to: "/runs" }, { label: "Queue" }] })}
      <main className="page">
        <div className={style.inner}>
          <div className="page-head">
            <h2 className="page-title">Queue</h2>
            <Link to="/robots">Robots</Link>
          </div>
          {found.isLoading && <Skeleton height={160} />}
          {found.isError && !found.data && (
            <Empty icon={<IconAlertTriangle size={22} />} title="The queue could not be loaded">
              {errorText(found.error)}
            </Empty>
          )}
          <SilentSites route="get /api/queue" missing="what waits there is not known" />
          {found.data && <Found queue={found.data} />}
        </div>
      </main>
    </>
  );
}
