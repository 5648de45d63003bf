/** A led run that waits for a person: the reason, what moves all the same, *Step* and *Go on*. */
import { NativeSelect } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconHandStop,
  IconPlayerPlayFilled,
  IconPlayerTrackNext,
  IconStairsUp,
} from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { errorText, isOutcomeUnknown } from "../api/http";
import { enginesOf } from "../api/led-runs";
import { silentRobots } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { letGoOn, letStep, type StepGoal } from "../api/presses";
import { SIMULATOR } from "../api/robots";
import { MOVES } from "../api/run-stop";
import type { Run } from "../api/runs";
import { spokenName } from "../graph/spoken-name";
import { HoldButton } from "../ui/hold-button";
import { boundedPart } from "../ui/lazy-part";
import { isolated } from "../words/isolated";
import style from "./held-notice.module.css";
import { actionWords, INTO, spokenIn } from "./level-places";
import { OutcomeQuestions } from "./outcome-question";
import { movingRests } from "./rests";
import { ServiceNotices } from "./robot-rights";
import { movesWords, robotsOfRun, useWatching, WatchTicks } from "./watching";

const AskedPeople = boundedPart(() => import("./asked-people").then((part) => part.AskedPeople), {
  waiting: null,
});

const NEXT = 3; // buttons of actions that wait

/** Return whether the simulator plays an action of this robot: nothing moves there. */
const isPlayed = (robot: string) => robot === "" || robot === SIMULATOR;

/** The performers of actions that no robot and no simulator plays, in words. */
const PERFORMERS: Readonly<Record<string, string>> = {
  people: "by people",
  runner: "by the runner",
};

/** Return an action and its robot in words. */
function placeWords(run: Run, action: string, robot: string): string {
  const where = PERFORMERS[robot] ?? `on ${isPlayed(robot) ? "the simulator" : isolated(robot)}`;
  return `${actionWords(run, action)} ${where}`;
}

/**
 * Return what goes on while a run is held, until its rest is proven, and what nobody knows since its
 * robot does not answer.
 */
function movingWords(run: Run, silent: ReadonlySet<string>): string {
  const seen = Object.entries(run.actions ?? {})
    .filter(([, { state }]) => MOVES.has(state))
    .map(([action, { robot }]) => ({ action, robot: robot ?? "" }));
  const begun = [
    ...seen,
    ...movingRests(run).filter(({ action }) => !seen.some((each) => each.action === action)),
  ];
  const said = (start: string, holds: (robot: string) => boolean) => {
    const places = begun
      .filter(({ robot }) => holds(robot))
      .map(({ action, robot }) => placeWords(run, action, robot));
    return places.length === 0 ? "" : `${start}: ${places.join(", ")}.`;
  };
  const sentences = [
    said("STILL MOVING", (robot) => !isPlayed(robot) && !silent.has(robot)),
    said("Not known, and may go on", (robot) => silent.has(robot)),
    said("Not over, and moves nothing", (robot) => isPlayed(robot) && !silent.has(robot)),
  ];
  return sentences.filter((each) => each !== "").join(" ") || "No action was seen to move.";
}

/**
 * Return the sentences of a held run; null for one that is not held, is being stopped or is over.
 * `silent`: robots that do not answer.
 */
export function heldWords(
  run: Run,
  silent: ReadonlySet<string>,
): { why: string; moving: string } | null {
  if (!run.held || run.ended_at !== null || run.desired === "stopped") return null;
  return {
    why: `Waiting: ${spokenIn(run, run.held.why).replace(/\.$/, "")}.`,
    moving: movingWords(run, silent),
  };
}

function failure(error: unknown, run: Run) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) return { color: "red", title: "Nothing has begun", message };
  return {
    color: "red",
    autoClose: false as const,
    title: `NOT KNOWN whether run ${run.number} goes on`,
    message: `${message} Assume that it does: its robots may already be moving.`,
  };
}

/** Return the opened sub-graphs over which a held run can go: those around all actions that wait to begin. */
function levelsAround(run: Run): string[][] {
  const ways = (run.held?.next ?? []).map(({ action }) => run.actions?.[action]?.levels ?? []);
  const [first = [], ...others] = ways;
  const shared = first.findIndex((name, at) => others.some((way) => way[at] !== name));
  const common = shared < 0 ? first : first.slice(0, shared);
  return common.map((_, at) => common.slice(0, at + 1)).reverse();
}

/** Return the actions until which a held run can go on: those of its graph that do not wait already. */
export function laterActions(run: Run): string[] {
  const ready = new Set((run.held?.next ?? []).map(({ action }) => action));
  return Object.keys(run.actions ?? {}).filter((name) => !name.includes("/") && !ready.has(name));
}

function StartButtons({ run, since }: { run: Run; since: string }) {
  const { live, runner, now } = useLive(run.id);
  const watch = useWatching(enginesOf(run));
  const press = useMutation({
    /** `goal`: how far it goes on; null for no limit. */
    mutationFn: (goal: StepGoal | null) =>
      goal === null
        ? letGoOn(runner ?? "", run.id, since, watch.watching)
        : letStep(runner ?? "", run.id, since, goal, watch.watching),
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error, run)),
    onSettled: watch.forget,
  });
  const [until, setUntil] = useState("");
  const later = laterActions(run);
  const end = until === "" ? "" : ` until ${actionWords(run, until)} is about to begin`;
  const obstacle = press.isPending ? "Asking …" : watch.obstacle;
  const disabled = obstacle !== null || now.link !== "live";
  const isPress = robotsOfRun(run).length === 0;
  const moves = movesWords(run);
  return (
    <>
      <WatchTicks watch={watch} />
      {(run.held?.next ?? []).slice(0, NEXT).map(({ action, robot }) => {
        const place = placeWords(run, action, robot);
        return (
          <HoldButton
            key={action}
            size="compact-sm"
            icon={<IconPlayerTrackNext size={13} aria-hidden />}
            label={`Step: ${actionWords(run, action)}`}
            name={`Let only ${place} begin, then wait again`}
            question={`Let only ${place} begin? ${robot === SIMULATOR ? "Nothing moves." : "A robot may begin to move at once."}`}
            disabled={disabled}
            isPress={isPress}
            onHeld={() => press.mutate({ action })}
          />
        );
      })}
      {levelsAround(run).map((over) => {
        const level = isolated(over.map(spokenName).join(INTO));
        return (
          <HoldButton
            key={level}
            size="compact-sm"
            icon={<IconStairsUp size={13} aria-hidden />}
            label={`Over ${level}`}
            name={`Let all inside of ${level} begin, then wait again`}
            question={`Let all inside of ${level} begin? ${moves}`}
            disabled={disabled}
            isPress={isPress}
            onHeld={() => press.mutate({ over })}
          />
        );
      })}
      <HoldButton
        size="compact-sm"
        icon={<IconPlayerPlayFilled size={13} aria-hidden />}
        label={obstacle ?? (isPress ? "Go on" : "Hold to go on")}
        name={`Let run ${run.number} go on${end}`}
        question={`Let run ${run.number} go on${end}? ${moves}`}
        disabled={disabled}
        isPress={isPress}
        onHeld={() => press.mutate(until === "" ? null : { until })}
      />
      {later.length > 0 && (
        <NativeSelect
          size="xs"
          aria-label="How far it goes on"
          value={until}
          data={[
            { value: "", label: "to its end, or a breakpoint" },
            ...later.map((name) => ({ value: name, label: `until ${actionWords(run, name)}` })),
          ]}
          onChange={(event) => setUntil(event.currentTarget.value)}
        />
      )}
    </>
  );
}

/** Asks people what a run needs from them: to let it go on, its questions, and outcomes that nothing shows. */
export function RunQuestions({ run }: { run: Run }) {
  return (
    <>
      <ServiceNotices run={run} />
      <HeldNotice run={run} />
      {(run.questions?.length || run.pauses?.length) && <AskedPeople run={run} />}
      <OutcomeQuestions run={run} />
    </>
  );
}

function HeldNotice({ run }: { run: Run }) {
  const may = useMay(run.simulated ? "simulate" : "operate");
  const { now } = useLive();
  const words = heldWords(run, silentRobots(now));
  if (words === null || !run.held) return null;
  return (
    <section className={style.notice} aria-label="The run waits for a person">
      <IconHandStop size={17} aria-hidden />
      <p role="alert">
        <b>{words.why}</b> {words.moving}
      </p>
      {may ? (
        <StartButtons key={run.held.since} run={run} since={run.held.since} />
      ) : (
        <span>Operators can let it go on.</span>
      )}
    </section>
  );
}
