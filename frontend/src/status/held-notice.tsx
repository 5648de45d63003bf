/** A led run that waits for a person: the reason, what moves all the same, and *Go on*. */
import { notifications } from "@mantine/notifications";
import { IconHandStop, IconPlayerPlayFilled } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { errorText, isOutcomeUnknown } from "../api/http";
import { enginesOf } from "../api/led-runs";
import { silentRobots } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { SIMULATOR } from "../api/robots";
import { MOVES } from "../api/run-stop";
import { letGoOn, type Run } from "../api/runs";
import { HoldButton } from "../ui/hold-button";
import { isolated } from "../words/isolated";
import style from "./held-notice.module.css";
import { actionWords } from "./level-places";
import { OutcomeQuestions } from "./outcome-question";
import { ServiceNotices } from "./robot-rights";
import { useWatching, WatchTicks } from "./watching";

/** Return what goes on while a run is held, and what nobody knows since its robot does not answer. */
function movingWords(run: Run, silent: ReadonlySet<string>): string {
  const begun = Object.entries(run.actions ?? {}).filter(([, { state }]) => MOVES.has(state));
  const said = (known: boolean) =>
    begun
      .filter(([, { robot }]) => silent.has(robot ?? "") !== known)
      .map(([name, { robot }]) => {
        const where = robot ? isolated(robot) : "the simulator";
        return `${actionWords(run, name)} on ${where}`;
      })
      .join(", ");
  const [goes, unknown] = [said(true), said(false)];
  const sentences = [
    goes === "" ? "" : `What was begun goes on: ${goes}.`,
    unknown === "" ? "" : `Not known, and may go on: ${unknown}.`,
  ];
  return sentences.join(" ").trim() || "No action was seen to move.";
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
    why: `Waiting: ${run.held.why.replace(/\.$/, "")}.`,
    moving: movingWords(run, silent),
  };
}

function failure(error: unknown, run: Run) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) return { color: "red", title: "It does not go on", message };
  return {
    color: "red",
    autoClose: false as const,
    title: `NOT KNOWN whether run ${run.number} goes on`,
    message: `${message} Its robots may move.`,
  };
}

function GoOnButton({ run, since }: { run: Run; since: string }) {
  const { live, runner, now } = useLive();
  const watch = useWatching(enginesOf(run));
  const goOn = useMutation({
    mutationFn: () => letGoOn(runner ?? "", run.id, since, watch.watching),
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error, run)),
  });
  const robots = enginesOf(run).filter((engine) => engine !== SIMULATOR);
  const players = robots.map(isolated).join(", ");
  const moves =
    players === "" ? "Nothing but the simulator moves." : `${players} may begin to move.`;
  return (
    <>
      <WatchTicks watch={watch} />
      <HoldButton
        size="compact-sm"
        icon={<IconPlayerPlayFilled size={13} aria-hidden />}
        label={goOn.isPending ? "Asking …" : (watch.obstacle ?? "Hold to go on")}
        name={`Let run ${run.number} go on`}
        question={`Let run ${run.number} go on? ${moves}`}
        disabled={goOn.isPending || watch.obstacle !== null || now.link !== "live"}
        onHeld={() => goOn.mutate()}
      />
    </>
  );
}

/** Asks people what a run needs from them: to let it go on, and outcomes that nothing shows. */
export function RunQuestions({ run }: { run: Run }) {
  return (
    <>
      <ServiceNotices run={run} />
      <HeldNotice run={run} />
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
        <GoOnButton key={run.held.since} run={run} since={run.held.since} />
      ) : (
        <span>Operators can let it go on.</span>
      )}
    </section>
  );
}
