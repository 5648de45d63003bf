/** The turn of an entry of the queue: the look before its start, what mends it on the spot, and the start. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { useLocation } from "wouter";
import { useVersions, versionName } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import {
  enginesOfEntry,
  type QueueEntry,
  type QueueLook,
  requestOfEntry,
  startEntry,
  useEntryLook,
} from "../api/queue";
import type { PreflightItem } from "../api/robots";
import type { Watching } from "../api/runs";
import { SecondPerson } from "../status/second-person";
import { askingRobots, BatonRemedy, ConfirmFirst } from "../status/start-remedies";
import { sendNoted, Unanswered } from "../status/unanswered-starts";
import { useWatching, WatchTicks } from "../status/watching";
import { HoldButton } from "../ui/hold-button";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./queue-page.module.css";

export const named = ({ robots }: QueueEntry): string =>
  robots.length === 0 ? "in the simulator" : `on ${robots.map(isolated).join(", ")}`;

export function Fault({ error }: { error: Error | null }) {
  if (error === null) return null;
  return (
    <p role="alert" className={style.error}>
      {errorText(error)}
    </p>
  );
}

/** Return whether an item keeps the start back; of what a person ticks or confirms the buttons say it. */
function isInTheWay(
  { code, verdict, overridable, codes }: PreflightItem,
  look: QueueLook,
): boolean {
  if (verdict !== "blocked" || code === "watched" || code === "confirm") return false;
  return !overridable || codes.some((each) => !look.overridden.includes(each));
}

/** Return why an entry cannot be started after this look, which the person saw as `seen`; null if it can. */
export function turnObstacle(look: QueueLook, seen: string | null): string | null {
  if (askingRobots(look.looks).length > 0) return "Confirm that it is you first";
  const found = look.looks.flatMap(({ items }) => items).filter((item) => isInTheWay(item, look));
  if (found.length > 0) return "A check prevents the start";
  return look.look === seen ? null : "Something has changed: look again";
}

interface ItemsProps {
  look: QueueLook;
  onLookAgain: () => void;
}

/** Items of a look that are worth a line: what is in the way, with its remedy, and what is only noted. */
function Items({ look, onLookAgain }: ItemsProps) {
  const items = look.looks.flatMap(({ engine, items: each }) =>
    each.map((item) => ({ engine, ...item })),
  );
  const worth = items.filter(({ verdict, code }) => verdict !== "passed" || code === "approved");
  return (
    <ul className={style.items} aria-label="Looked at">
      {worth.map(({ engine, code, verdict, text }) => (
        <li key={`${engine} ${code} ${text}`} data-verdict={verdict}>
          {verdict === "blocked" ? "In the way: " : verdict === "warned" ? "Note: " : ""}
          {text}
          {code === "baton" && verdict === "blocked" && (
            <>
              <BatonRemedy engine={engine} onTaken={onLookAgain} />
              <span className="quiet-12">
                A baton that changes hands closes the queue of {isolated(engine)}: whoever takes it
                looks again, and opens it.
              </span>
            </>
          )}
        </li>
      ))}
      <li className="ink2">{counted(items.length - worth.length, "check")} passed.</li>
    </ul>
  );
}

interface RemediesProps {
  entry: QueueEntry;
  look: QueueLook;
  /** The look is another one than its person asked for. */
  changed: boolean;
}

/** A second person's yes to an entry, and a confirmation of its starter, where they are asked for. */
function Remedies({ entry, look, changed }: RemediesProps) {
  const versions = useVersions(entry.graph ?? "", entry.version).data;
  const items = look.looks.flatMap(({ items: each }) => each);
  // While a check that somebody could override is in the way, this start is not the one that will be sent.
  const isAnother = items.some((item) => item.overridable && isInTheWay(item, look));
  return (
    <>
      {!isAnother && (
        <SecondPerson
          graph={entry.graph ?? ""}
          label={versionName(versions, entry.version) || entry.graph_name}
          looks={look.looks}
          values={entry.values}
          taken={null}
          changed={changed}
        />
      )}
      <ConfirmFirst looks={look.looks} />
    </>
  );
}

/** Start an entry as it was looked at. Where its answer gets lost, the page looks for its run. */
function useStartEntry(entry: QueueEntry) {
  const [, go] = useLocation();
  const { live, runner = "" } = useLive();
  return useMutation({
    mutationFn: ({ look, watching }: { look: string; watching: Watching }) => {
      const [request, what] = [requestOfEntry(entry.id), isolated(entry.graph_name)];
      const start = { request, graph: entry.graph ?? "", what, engines: enginesOfEntry(entry) };
      return sendNoted(start, () => startEntry(runner, entry.id, look, watching));
    },
    onSuccess: ({ runs, failed }) => {
      for (const run of runs) live?.learn(run);
      for (const [robot, why] of Object.entries(failed))
        notifications.show({
          color: "red",
          title: `Not started on ${isolated(robot)}`,
          message: why,
          autoClose: false,
        });
      const [first] = runs;
      if (first) go(`/runs/${first.id}`);
    },
  });
}

interface BeginProps {
  entry: QueueEntry;
  /** The reason why it cannot be started now; null when it can. */
  obstacle: string | null;
  isPending: boolean;
  onStart: () => void;
}

/** The button that starts what was looked at: held where something may move. */
function BeginButton({ entry, obstacle, isPending, onStart }: BeginProps) {
  const what = `Start ${isolated(entry.graph_name)} ${named(entry)}`;
  if (entry.robots.length > 0)
    return (
      <HoldButton
        label={obstacle ?? "Hold to start"}
        name={obstacle === null ? what : `${what}: ${obstacle}`}
        question={`You have looked: ${what}?`}
        disabled={obstacle !== null || isPending}
        onHeld={onStart}
      />
    );
  return (
    <Button variant="filled" disabled={obstacle !== null} loading={isPending} onClick={onStart}>
      {obstacle ?? what}
    </Button>
  );
}

/** The look before the start of an entry whose turn it is, and the button that starts it. */
export function Turn({ entry }: { entry: QueueEntry }) {
  const watch = useWatching(entry.robots);
  const [asked, setAsked] = useState(false);
  /** The look that its person asked for: what is found by itself later is none. */
  const [seen, setSeen] = useState<string | null>(null);
  const look = useEntryLook(entry.id, watch.watching, asked);
  const found = asked ? look.data : undefined;
  const start = useStartEntry(entry);
  const lookAgain = async () => {
    start.reset();
    setAsked(true);
    const { data } = await look.refetch();
    setSeen(data?.look ?? null);
  };
  const begin = () => {
    if (!found) return;
    const onSettled = () => {
      watch.forget();
      setAsked(false);
    };
    start.mutate({ look: found.look, watching: watch.watching }, { onSettled });
  };
  const obstacle = watch.obstacle ?? (found ? turnObstacle(found, seen) : null);
  const differs = found?.differs ?? entry.differs;
  return (
    <section
      className={style.turn}
      aria-label={`Before the start of ${isolated(entry.graph_name)}`}
    >
      {differs.length > 0 && (
        <div className={style.differs}>
          <b>It is not as it was when it was put here:</b>
          <ul>
            {differs.map((each) => (
              <li key={each}>{each}</li>
            ))}
          </ul>
        </div>
      )}
      {found && <Items look={found} onLookAgain={() => void look.refetch()} />}
      {found && <Remedies entry={entry} look={found} changed={found.look !== seen} />}
      {found && <WatchTicks watch={watch} />}
      <div className={style.buttons}>
        <Button
          variant={found ? "subtle" : "filled"}
          loading={asked && !found && look.isFetching}
          onClick={() => void lookAgain()}
        >
          {found ? "Look again" : "Look before the start"}
        </Button>
        {found && (
          <BeginButton
            entry={entry}
            obstacle={obstacle}
            isPending={start.isPending}
            onStart={begin}
          />
        )}
      </div>
      {/* An answer that is missing is told by the notice of all such starts. */}
      <Fault error={start.error instanceof Unanswered ? null : (start.error ?? look.error)} />
    </section>
  );
}
