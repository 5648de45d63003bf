/** The head of the drawer: which run, how it stands, and what can be done with it. */
import { ActionIcon, Button, Text } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconChartBar,
  IconChevronDown,
  IconChevronUp,
  IconEye,
  IconHistory,
  IconPlayerPause,
  IconPlayerPlay,
} from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { Link } from "wouter";
import { errorText, isOutcomeUnknown } from "../../api/http";
import { enginesOf } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { useCurrentName, useMay } from "../../api/people";
import { needsRestConfirmation } from "../../api/run-stop";
import { abilitiesOf, pauseRun, type Run, resumeRun } from "../../api/runs";
import { runTimeOf, shiftOfRun } from "../../api/site-places";
import { boundsText } from "../../status/durations";
import { fromWords } from "../../status/earlier-list";
import { useRunStatus } from "../../status/progress";
import { StateLabel } from "../../status/state-label";
import { WaitButton } from "../../status/wait-button";
import { useWatching, WatchTicks } from "../../status/watching";
import { lazyPart, OverlayBoundary } from "../../ui/lazy-part";
import { colorOfName } from "../../ui/name-colors";
import { clock, day, instant, stopwatch, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import { ContinueButton } from "../start/continue-button";
import style from "./run-drawer.module.css";

const ConfirmRestDialog = lazyPart(() =>
  import("../stop/confirm-rest-dialog").then((part) => part.ConfirmRestDialog),
);

/** Offers to end a run by a person's word where no answer of its engine can prove that nothing moves. */
export function ConfirmRestButton({ run, robot }: { run: Run; robot?: string }) {
  const may = useMay("operate");
  const [asking, setAsking] = useState<boolean | null>(null);
  if (!may || !needsRestConfirmation(run)) return null;
  return (
    <>
      <Button
        size="compact-xs"
        variant="light"
        color="red"
        flex="none"
        leftSection={<IconEye size={14} aria-hidden />}
        onClick={() => setAsking(true)}
      >
        {robot === undefined ? "I looked …" : `I looked at ${isolated(robot)} …`}
      </Button>
      <OverlayBoundary>
        {asking !== null && (
          <ConfirmRestDialog
            run={run}
            robot={robot}
            opened={asking}
            onClose={() => setAsking(false)}
          />
        )}
      </OverlayBoundary>
    </>
  );
}

interface Props {
  run: Run;
  versionLabel: string;
  /** More words about the run, if there is room and anything to say; else empty. */
  told: string;
  announces: boolean;
  /** The canvas shows the run as it was at an earlier moment, ms. */
  cursor: number | null;
  onLive: () => void;
  /** Null: it cannot be folded. */
  folded: boolean | null;
  onFold: (folded: boolean) => void;
}

function FoldButton({ folded, onFold }: { folded: boolean; onFold: Props["onFold"] }) {
  const Sign = folded ? IconChevronUp : IconChevronDown;
  return (
    <ActionIcon
      size={24}
      aria-label={folded ? "Show the lanes" : "Hide the lanes"}
      aria-expanded={!folded}
      onClick={() => onFold(!folded)}
    >
      <Sign size={16} aria-hidden />
    </ActionIcon>
  );
}

/** Shows who started the run, when, and how long it took or has been running. */
function Origin({ run, until }: { run: Run; until: number | null }) {
  const by = useCurrentName(run.author);
  const goes = run.ended_at === null;
  const present = useNow(1000, goes && until === null) - shiftOfRun(run.id);
  const start = instant(run.started_at) ?? present;
  const when = day(start, present);
  const started = when === "today" ? `at ${clock(start)}` : `${when} ${clock(start)}`;
  const took = goes
    ? stopwatch((until ?? present) - start)
    : (boundsText(run.took) ?? stopwatch((instant(run.ended_at) ?? present) - start));
  return (
    <Text span c="dimmed" size="xs" truncate>
      {run.simulated && "simulated · "}
      {run.from && `${fromWords(run.from)} · `}
      started by {isolated(by)} {started} · {took}
    </Text>
  );
}

/** Links to the statistics of the graph and to the page of the run. */
function Ways({ run }: { run: Run }) {
  return (
    <>
      {run.graph !== null && (
        <Button
          component={Link}
          to={`/runs/statistics?graph=${encodeURIComponent(run.graph)}`}
          size="compact-xs"
          variant="subtle"
          color="gray"
          flex="none"
          leftSection={<IconChartBar size={14} aria-hidden />}
        >
          Statistics
        </Button>
      )}
      <Button
        component={Link}
        to={`/runs/${run.id}`}
        size="compact-xs"
        variant="subtle"
        flex="none"
      >
        Open run
      </Button>
    </>
  );
}

export function RunHead(props: Props) {
  const { run, versionLabel, told, announces, cursor, onLive, folded, onFold } = props;
  const { now } = useLive(run.id);
  const goes = run.ended_at === null;
  const unsure = now.link === "down" && goes;
  return (
    <header className={style.head}>
      <b>Run {run.number}</b>
      {!run.simulated &&
        enginesOf(run).map((engine) => (
          <span key={engine} className={style.robot}>
            <i style={{ background: colorOfName(engine) }} aria-hidden /> {engine}
          </span>
        ))}
      <span className={style.version}>{versionLabel}</span>
      <StateLabel pill still {...useRunStatus(run)} />
      <Origin run={run} until={unsure ? runTimeOf(run.id, now.since) : null} />
      <span className="flex-1" />
      {told !== "" && (
        <span className={style.alarm} role={announces ? "alert" : undefined} title={told}>
          {told}
        </span>
      )}
      {!run.recorded && <span className={style.alarm}>not recorded</span>}
      <span className="row flex-none gap-35">
        {cursor !== null && (
          <Button
            size="compact-xs"
            variant="light"
            leftSection={<IconHistory size={14} aria-hidden />}
            onClick={onLive}
          >
            {goes ? "Back to live" : "Back to its end"}
          </Button>
        )}
        {goes && !run.robots && <ConfirmRestButton key={run.id} run={run} />}
        {goes && <PauseButton run={run} />}
        <WaitButton run={run} />
        {!goes && <ContinueButton key={run.id} run={run} />}
        <Ways run={run} />
        {folded !== null && <FoldButton folded={folded} onFold={onFold} />}
      </span>
    </header>
  );
}

/** Nobody has answered: it may have been done all the same. */
function failure(error: unknown, paused: boolean) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) {
    return { color: "red", title: paused ? "It does not go on" : "Not paused", message };
  }
  const assume = paused
    ? "Assume that it does: the robot may already be moving."
    : "Assume that it does not: the robot may still be moving.";
  return {
    color: "red",
    autoClose: false as const,
    title: `NOT KNOWN whether the run ${paused ? "goes on" : "pauses"}`,
    message: `${message} ${assume}`,
  };
}

const NOBODY: readonly string[] = [];

function PauseButton({ run }: { run: Run }) {
  const { runner, now } = useLive(run.id);
  const may = useMay(run.simulated ? "simulate" : "operate");
  const engine = now.engines.find((each) => each.name === abilitiesOf(run));
  const paused = run.desired === "paused";
  const watch = useWatching(paused && !run.simulated ? [run.engine] : NOBODY);
  const steer = useMutation({
    mutationFn: () =>
      paused ? resumeRun(runner ?? "", run.id, watch.watching) : pauseRun(runner ?? "", run.id),
    onError: (error) => notifications.show(failure(error, paused)),
    onSettled: watch.forget,
  });
  const goes = run.state === "running" || run.state === "paused";
  if (!may || engine?.pauses !== true || !goes || run.desired === "stopped") return null;
  const Sign = paused ? IconPlayerPlay : IconPlayerPause;
  const why = now.link === "down" ? "The runner does not answer" : watch.obstacle;
  return (
    <>
      <WatchTicks watch={watch} />
      <Button
        size="compact-xs"
        leftSection={<Sign size={13} aria-hidden />}
        loading={steer.isPending}
        disabled={why !== null}
        title={why ?? undefined}
        onClick={() => steer.mutate()}
      >
        {paused ? "Go on" : "Pause"}
      </Button>
    </>
  );
}
