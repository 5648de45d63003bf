/** Notice with the state of a Stop, in words, until it is proven. */

import { useLayoutEffect, useRef, useState } from "react";
import { engineWords } from "../../api/led-runs";
import type { LiveState, SiteState, StopRequest } from "../../api/live-socket";
import {
  foreignGraphs,
  openRuns,
  stateOf,
  stopTargets,
  unheardRobots,
} from "../../api/live-socket";
import { useLive } from "../../api/page-link";
import type { Robot } from "../../api/robots";
import { needsRestConfirmation } from "../../api/run-stop";
import type { Run } from "../../api/runs";
import { serverTimeOf, tick } from "../../clock/server-clock";
import { HelpLink } from "../../status/help-link";
import { spokenIn } from "../../status/level-places";
import { restLines } from "../../status/rests";
import { clock, duration, instant, useTick } from "../../ui/times";
import { useRootMark } from "../../ui/use-root-mark";
import { useWatched } from "../../ui/watched";
import { isolated } from "../../words/isolated";
import style from "./stop-notice.module.css";
import { askedRun, mayAnswer } from "./stop-surroundings";

const LOUD = 2_500; // ms without proof until the notice shouts
const HEARD = 1_200; // ms within which the runner answers a Stop, if it does
const GONE = 6_000; // ms that a proven stop stays to be read
const MOST_SILENT = 3; // robots that can be said to be at rest from here; each run says so of its own

/** `since` goes on with each moment, so it is seen but not announced again and again. */
interface Notice {
  tone: "quiet" | "loud" | "done";
  text: string;
  since?: string;
  stays?: true;
  /** The loud notices of which it consists, where there are several. */
  loud?: readonly { text: string }[];
}

export type StopNoticeText = Notice | null;

/** Return the runner's reason why the Stop is not proven; "" before it has given one. */
function reasonOf(run: Run): string {
  const alarm = run.alarms.findLast((each) => each.code === "stop_unconfirmed");
  const told = run.unconfirmed
    ? `${run.unconfirmed.replace(/\.$/, "")}.`
    : (alarm?.text ?? "").replace(/^STOP UNCONFIRMED: /, "");
  return spokenIn(run, told);
}

function unconfirmed(runs: readonly Run[], since?: string): StopNoticeText {
  const each = runs.map((run) => `run ${run.number} on ${engineWords(run)}`).join(", ");
  const why = runs.map(reasonOf).find((reason) => reason !== "") ?? "no proof has come.";
  const look = runs.some((run) => run.unconfirmed)
    ? " Look at the robot; use its hardware stop."
    : "";
  const text = `STOP UNCONFIRMED: ${each}: ${why}${look}`;
  return { tone: "loud", stays: true, text, ...(since === undefined ? {} : { since }) };
}

/** Never says "stopped" without the runs' own state saying so. */
export function noticeOf(stop: StopRequest, now: LiveState, at: number): StopNoticeText {
  const waited = at - stop.at;
  const since = `asked ${duration(waited)} ago`;
  if (stop.state === "refused") {
    const told =
      stop.disownedPerson === undefined
        ? `Stop refused: ${isolated(stop.detail)}`
        : `NOT SENT: STOP ALL of ${isolated(stop.disownedPerson)}, ${clock(serverTimeOf(stop.at))}. Press STOP again.`;
    return { tone: "loud", text: `${told} Use the hardware stop.` };
  }
  const unsent = stop.state === "unheard" || (stop.state === "asked" && waited > HEARD);
  if (unsent) {
    const { kind, why: reason } = now.unreached ?? {};
    const why = (kind === "strange" && reason) || stop.detail || "The runner does not answer.";
    return {
      tone: "loud",
      stays: true,
      text: `NOT SENT: use the hardware stop. ${isolated(why)} Trying again.`,
      since,
    };
  }
  const runs = stopTargets(stop, now);
  const open = runs.filter((run) => run.ended_at === null);
  const down = now.link === "down";
  const isKnown = stop.provenAt !== undefined || (stop.run !== "all" && runs.length > 0);
  if (down && (open.length > 0 || !isKnown)) return silentNotice(runs, now, since);
  const sent = (): StopNoticeText =>
    waited < LOUD ? { tone: "quiet", text: "Stop sent", since } : silentNotice(runs, now, since);
  if (now.link === "connecting" && !isKnown) return sent();
  if (open.length > 0) {
    if (waited >= LOUD) return unconfirmed(open, since);
    const names = open.map((run) => `run ${run.number}`).join(", ");
    return { tone: "quiet", text: `Stopping ${names} …`, since };
  }
  const lost = runs.filter((run) => run.state === "lost");
  if (lost.length > 0) {
    const ends = lost
      .map((run) => `run ${run.number} on ${engineWords(run)}: ${isolated(run.detail)}`)
      .join(" ");
    return { tone: "loud", text: `STOP UNCONFIRMED: ${ends} Look at the robot.` };
  }
  if (stop.awaits !== undefined) return sent();
  if (!down && stop.provenAt === undefined && stop.runs.some((id) => !now.runs.has(id))) {
    const text =
      "STOP UNCONFIRMED: the runner does not say how a run ended that was to be stopped. Look at the robot.";
    return { tone: "loud", text };
  }
  const foreign = stop.run === "all" && !down ? foreignNotice(now, since) : null;
  if (foreign !== null) return foreign;
  if (at - (stop.provenAt ?? stop.at) > GONE) return null;
  if (stop.state === "asked") return { tone: "quiet", text: "Stop", since };
  if (down) return provenNotice(runs, stop.provenAt, now);
  if (runs.length === 0 && openRuns(now).length > 0) return null; // begun since
  return doneNotice(runs, stop.run === "all" ? unheardRobots(now) : []);
}

const isAtRest = (run: Run) => run.ended_at !== null && run.state !== "lost";
const endOf = (run: Run) => {
  const at = instant(run.proof_at ?? run.ended_at);
  return `run ${run.number}: ${run.state}${at === null ? "" : ` at ${clock(at)}`}`;
};

/** The runner is silent since: what it said before that stays true, and of the rest nothing is known. */
function silentNotice(runs: readonly Run[], now: LiveState, since: string): StopNoticeText {
  const open = runs.filter((run) => !isAtRest(run));
  const who = open.map((run) => `run ${run.number} on ${engineWords(run)}: `).join("");
  const before = runs.filter(isAtRest).map(endOf).join(", ");
  const proven = before === "" ? "" : ` Proven before that: ${before}.`;
  const ended =
    now.unreached?.kind === "ended"
      ? " The session has ended: a proof is shown only once somebody signs in."
      : "";
  const text = `STOP UNCONFIRMED: ${who}sent, but no word from the runner since.${ended}${proven}`;
  return { tone: "loud", stays: true, text, since };
}

/** All that was to be stopped rested before the runner fell silent. */
function provenNotice(
  runs: readonly Run[],
  at: number | undefined,
  now: LiveState,
): StopNoticeText {
  const then = at === undefined ? "" : ` at ${clock(serverTimeOf(at))}`;
  const ends = runs.length === 0 ? `nothing ran${then}` : runs.map(endOf).join(" · ");
  const text = `Proven: ${ends}. The runner is silent since ${clock(serverTimeOf(now.since))}; what began after that is not known.`;
  return { tone: "done", text };
}

/**
 * Notice about graphs that were not started from here and are being stopped, until proven;
 * unconfirmed ones first.
 */
function foreignNotice(now: LiveState, since?: string): StopNoticeText {
  const stopping = foreignGraphs(now).filter(({ held }) => held.stopping !== null);
  const [first] = stopping.sort((a, b) => Number(!a.held.stopping) - Number(!b.held.stopping));
  if (first === undefined) return null;
  const { robot, held } = first;
  if (!held.stopping) {
    return {
      tone: "quiet",
      text: `Stopping ${isolated(held.graph)} on ${isolated(robot.name)} …`,
      ...(since && { since }),
    };
  }
  const text = `STOP UNCONFIRMED: ${isolated(held.graph)} on ${isolated(robot.name)}: ${isolated(held.stopping)}.`;
  return { tone: "loud", stays: true, text };
}

/** Notice that all runs that the runner knows of have ended. */
function doneNotice(runs: readonly Run[], unknown: readonly Robot[]): StopNoticeText {
  const ends = runs.map((run) => `Run ${run.number}: ${run.state}`).join(" · ");
  if (unknown.length === 0) {
    const text = runs.length === 0 ? "The runner says that nothing runs." : `${ends}.`;
    return { tone: "done", text };
  }
  const names = unknown.map(({ name }) => isolated(name)).join(", ");
  const one = unknown.length === 1 ? "runs" : "run";
  const why = isolated(unknown[0]?.why ?? "");
  const head = runs.length === 0 ? "No run from here goes on." : `${ends}.`;
  return { tone: "loud", text: `${head} NOT KNOWN what ${names} ${one}. ${why}`.trimEnd() };
}

/** A run that was said to be over and is not: nothing else is as urgent. */
export function movingAgain(now: LiveState): StopNoticeText {
  const runs = openRuns(now).filter((run) => run.moves_again_at);
  if (runs.length === 0) return null;
  const each = runs.map((run) => {
    const told = run.alarms.findLast((alarm) => alarm.code === "moves_again");
    const text = spokenIn(run, told?.text ?? "").replace(/^MOVES AGAIN: /, "");
    const isAsked = now.stops.some(
      (stop) =>
        stop.provenAt === undefined && (stop.run === "all" || stopTargets(stop, now).includes(run)),
    );
    const unasked = isAsked ? "" : " Nobody has asked to stop it.";
    const then = run.desired === "stopped" ? " It is being stopped again." : unasked;
    return `run ${run.number}: ${text}${then}`;
  });
  const since =
    now.link === "down" ? ` Runner unknown since ${clock(serverTimeOf(now.since))}.` : "";
  const text = `MOVES AGAIN: ${each.join(" ")}${since} Use the hardware stop if it must not move.`;
  return { tone: "loud", stays: true, text };
}

/**
 * Return the notice about Stops that other people asked for and that are not proven: everybody sees
 * it. `own`: the runs of which another notice tells.
 */
export function othersNotice(now: LiveState, own: ReadonlySet<Run> = new Set()): StopNoticeText {
  if (now.link === "down") return null;
  const shouting = openRuns(now).filter(
    (run) =>
      !own.has(run) &&
      (Boolean(run.unconfirmed) || (run.desired === "stopped" && reasonOf(run) !== "")),
  );
  if (shouting.length > 0) return unconfirmed(shouting);
  const foreign = foreignNotice(now);
  return foreign?.tone === "loud" ? foreign : null;
}

const UNREACHED = 6_000; // ms that the runner may take to answer before a page says that it does not

/**
 * Return the notice that a Stop would reach nobody, or that nothing would prove it; null while the link is live and in
 * the first 6 s without it. STOP itself looks as always, so this is said before it is needed. `at`: the present by
 * `tick`, ms.
 */
export function unreachableNotice(now: LiveState, at: number): StopNoticeText {
  if (now.link === "live" || at - now.since < UNREACHED) return null;
  const { kind, why } = now.unreached ?? { kind: "silent", why: "The runner does not answer." };
  const head = kind === "mute" ? "STOP CANNOT BE PROVEN HERE" : "STOP MAY REACH NOBODY";
  const text = `${head}: ${isolated(why)} Use the hardware stop.`;
  return { tone: "loud", stays: true, text };
}

/**
 * Return the state of a site without the Stops that are none of its: a run is at one site, and the others do not
 * have it. What a site refuses for another reason stays in sight until another site has heard the Stop.
 */
function withOwnStops(now: LiveState, sites: readonly SiteState[]): LiveState {
  const isElsewhere = ({ id, run, state: said, isAbsent }: StopRequest) =>
    said === "refused" &&
    run !== "all" &&
    sites.some(({ state: { stops } }) =>
      stops.some(
        ({ id: other, state }) =>
          other === id && (state === "heard" || (isAbsent && state !== "refused")),
      ),
    );
  return { ...now, stops: now.stops.filter((stop) => !isElsewhere(stop)) };
}

/**
 * Return the Stops of which a notice tells, the newest first: the last one, and each earlier one that is not
 * dealt with. `dismissed`: the ids of the Stops of which nobody wants to hear more, unless they could not be sent.
 */
function toldStops(now: LiveState, dismissed: ReadonlySet<string>): StopRequest[] {
  const isDue = (stop: StopRequest, i: number) =>
    i === now.stops.length - 1 ||
    stop.state !== "heard" ||
    stop.awaits !== undefined ||
    openAimsOf(stop, now).length > 0;
  return now.stops
    .filter((stop, i) => isDue(stop, i) && !isCovered(stop, now.stops.slice(i + 1), now))
    .filter(({ id, state }) => state === "unheard" || !dismissed.has(id))
    .reverse();
}

/** Return the ids of the runs that a Stop is about and that are not known to rest. */
function openAimsOf(stop: StopRequest, now: LiveState): string[] {
  const ids = new Set([...stop.runs, ...stopTargets(stop, now).map(({ id }) => id)]);
  return [...ids].filter((id) => {
    const run = now.runs.get(id);
    return run === undefined ? stop.provenAt === undefined : !isAtRest(run);
  });
}

/** Return whether one of the later Stops means all that a Stop is about. */
function isCovered(stop: StopRequest, later: readonly StopRequest[], now: LiveState): boolean {
  const runs = stopTargets(stop, now);
  const open = openAimsOf(stop, now);
  const means = ({ run, runs: stopped }: StopRequest) =>
    (run === "all" && open.every((id) => stopped.includes(id))) ||
    (run !== "all" && run === stop.run) ||
    (runs.length > 0 && runs.every((each) => each.group === run));
  return later.some(means);
}

const TONES = ["loud", "quiet", "done"] as const;

/** Return one notice of several, the worst first: none hides another one. */
function worstFirst(notices: readonly Notice[]): StopNoticeText {
  const worst = TONES.flatMap((tone) => notices.filter((notice) => notice.tone === tone));
  const [first, ...others] = worst;
  if (first === undefined || others.length === 0) return first ?? null;
  const textsOf = (parts: typeof worst) => [...new Set(parts.map(({ text }) => text))];
  const loud = textsOf(worst.filter(({ tone }) => tone === "loud"));
  return {
    ...first,
    text: textsOf(worst).join(" "),
    ...(worst.some(({ stays }) => stays) && { stays: true }),
    ...(loud.length > 1 && { loud: loud.map((text) => ({ text })) }),
  };
}

/** A Stop that was not taken says by itself not which one it is. */
function textOf(stop: StopRequest, text: string, now: LiveState): string {
  if (stop.state === "heard" || stop.run === "all") return text;
  const runs = stopTargets(stop, now).map((run) => `run ${run.number} on ${engineWords(run)}`);
  return runs.length === 0 ? text : `${text} This is about ${runs.join(", ")}.`;
}

/** Return the notices of one runner. `dismissed`: as for `toldStops`. */
function noticesOf(now: LiveState, dismissed: ReadonlySet<string>, at: number): readonly Notice[] {
  const moving = movingAgain(now);
  const own = toldStops(now, dismissed).flatMap((stop) => {
    const notice = noticeOf(stop, now, at);
    return notice === null ? [] : [{ stop, notice }];
  });
  const others = othersNotice(now, new Set(own.flatMap(({ stop }) => stopTargets(stop, now))));
  const isOne = own.length === 1 && others === null && moving === null;
  const told = own.map(({ stop, notice }) =>
    isOne ? notice : { ...notice, text: textOf(stop, notice.text, now) },
  );
  const all = [moving, ...told, others].filter((notice) => notice !== null);
  const unreachable = unreachableNotice(now, at);
  return all.length > 0 || unreachable === null ? all : [unreachable];
}

/**
 * Return one notice of all that there is to say of Stops; with several sites each part says at which it is.
 * `dismissed`: as for `toldStops`.
 */
export function wholeNotice(
  now: LiveState,
  dismissed: ReadonlySet<string>,
  at: number,
): StopNoticeText {
  const { sites } = now;
  if (sites === undefined) return worstFirst(noticesOf(now, dismissed, at));
  const told = sites.flatMap(({ site: { name }, state }) =>
    noticesOf(withOwnStops(state, sites), dismissed, at).map((notice) => ({
      ...notice,
      text: atSite(notice.text, isolated(name)),
    })),
  );
  return worstFirst(told) ?? unreachableNotice(now, at);
}

function atSite(text: string, site: string): string {
  const [head = "", ...rest] = text.split(":");
  const shouts = rest.length > 0 && /^([A-Z ]+|Stop refused)$/.test(head);
  return shouts ? `${head} at ${site}:${rest.join(":")}` : `${site}: ${text}`;
}

/**
 * Return the led runs of which a Stop notice tells robot by robot: those that the newest Stop means,
 * and all others that are being stopped.
 */
function runsByRobot(now: LiveState, stop: StopRequest | undefined): Run[] {
  const meant = stop === undefined ? [] : stopTargets(stop, now);
  const stopping = openRuns(now).filter((run) => run.desired === "stopped");
  return [...new Set([...meant, ...stopping])].filter((run) => (run.rests ?? []).length > 0);
}

/** The rest of each robot of a led run: the run as a whole is never better than its worst robot. */
function RobotLines({ run, unheard, named }: { run: Run; unheard: boolean; named: boolean }) {
  return (
    <ul className={style.robots} aria-label={`Rest of each robot of run ${run.number}`}>
      {restLines(run, unheard).map(({ robot, words }) => (
        <li key={robot}>
          {named && `Run ${run.number}, `}
          <bdi className="weight-700">{robot}</bdi>: {words}
        </li>
      ))}
    </ul>
  );
}

type Told = Pick<NonNullable<StopNoticeText>, "text" | "loud">;

/**
 * Return the headline that stays visible when the notice is minimized, such as STOP UNCONFIRMED.
 */
export function headOf({ text, loud = [{ text }] }: Told): string {
  return loud.map((part) => part.text.split(":", 1)[0]).join(" · ");
}

/**
 * Return a key by which a minimized notice stays minimized while its text is the same; a new text
 * opens it again.
 */
export function noticeKey({ text, loud = [{ text }] }: Told): string {
  const keys = loud.map((part) => [headOf(part), ...(part.text.match(/run \d+/g) ?? []).sort()]);
  return keys.flat().join(" ");
}

/**
 * Tracks whether a person has minimized the loud notice; its headline stays visible. `asked`: the
 * newest Stop, which opens the notice again.
 */
function useAside(notice: StopNoticeText, asked: string) {
  const [put, setPut] = useState("");
  const key = notice?.stays ? `${asked} ${noticeKey(notice)}` : "";
  // Once it is over, or about something else, it is not aside any more: the next one is shouted.
  if (put !== "" && key !== put) setPut("");
  return {
    is: key !== "" && key === put,
    put: () => setPut(key),
    bringBack: () => setPut(""),
  };
}

function Cross() {
  return (
    <svg viewBox="0 0 16 16" width={14} height={14} aria-hidden>
      <path
        d="M3 3 13 13 M13 3 3 13"
        stroke="currentColor"
        strokeWidth="1.8"
        strokeLinecap="round"
      />
    </svg>
  );
}

/** Tells the page how high the loud notice is, so that dialogs and messages leave room for it. */
function useNoticeRoom(isLoud: boolean) {
  const notice = useRef<HTMLDivElement>(null);
  useRootMark("data-loud-notice", isLoud);
  useLayoutEffect(() => {
    if (!isLoud || notice.current === null) return;
    const { style: root } = document.documentElement;
    const seen = notice.current;
    const watch = new ResizeObserver(() =>
      root.setProperty("--notice-height", `${seen.offsetHeight}px`),
    );
    watch.observe(seen);
    return () => watch.disconnect();
  }, [isLoud]);
  return notice;
}

export function StopNotice() {
  const { now } = useLive();
  const canAnswer = useWatched(mayAnswer);
  const [dismissed, setDismissed] = useState<ReadonlySet<string>>(new Set());
  const last = now.stops.at(-1);
  const watching = last !== undefined && !dismissed.has(last.id);
  const open = openRuns(now).length;
  const states = now.sites?.map(({ state }) => state) ?? [now];
  const told = states.flatMap((state) => toldStops(state, dismissed));
  const busy = told.some(
    (each) =>
      open > 0 || each.state !== "heard" || tick() - (each.provenAt ?? each.at) < GONE + 1000,
  );
  const at = useTick(200, busy || [now, ...states].some(({ link }) => link !== "live"));
  const notice = wholeNotice(now, dismissed, at);
  const aside = useAside(notice, last?.id ?? "");
  const element = useNoticeRoom(notice?.tone === "loud" && !aside.is);
  useRootMark("data-notice-aside", aside.is && notice !== null);
  if (notice === null) return null;
  if (aside.is) {
    return (
      <button type="button" className={style.aside} onClick={aside.bringBack} title={notice.text}>
        <svg viewBox="0 0 16 16" width={15} height={15} aria-hidden>
          <path
            d="M5 1.5h6L14.5 5v6L11 14.5H5L1.5 11V5Z M8 4.5v4 M8 11v.5"
            fill="none"
            stroke="currentColor"
            strokeWidth="1.6"
            strokeLinecap="round"
          />
        </svg>
        <span>{headOf(notice)}</span>
      </button>
    );
  }
  const silent =
    canAnswer && notice.tone === "loud"
      ? openRuns(now).filter(
          (run) => needsRestConfirmation(run) && stateOf(now, run.id).link !== "down",
        )
      : [];
  const byRobot = runsByRobot(now, watching ? last : undefined);
  const hide = notice.stays
    ? { label: "Put aside", run: aside.put }
    : {
        label: "Hide",
        run: () => setDismissed(new Set([...dismissed, ...told.map(({ id }) => id)])),
      };
  return (
    <div
      ref={element}
      className={style.notice}
      data-tone={notice.tone}
      role={notice.tone === "loud" ? "alert" : "status"}
    >
      <span>
        <span>{notice.text}</span>
        {byRobot.map((run) => (
          <RobotLines
            key={run.id}
            run={run}
            unheard={stateOf(now, run.id).link === "down"}
            named={byRobot.length > 1}
          />
        ))}
        {notice.since !== undefined && (
          <span aria-hidden className={style.since}>
            {` ${notice.since}`}
          </span>
        )}
        {notice.tone === "loud" && (
          <span className={style.help}>
            <HelpLink place="operators-guide.html#stop-unconfirmed" words="What to do" />
          </span>
        )}
      </span>
      {silent.length > 0 && (
        <span className={style.looked}>
          {silent.slice(0, MOST_SILENT).map((run) => (
            <button
              key={run.id}
              type="button"
              className={style.look}
              onClick={() => askedRun.set(run.id)}
            >
              {silent.length > 1 ? `I looked at ${engineWords(run)} …` : "I looked …"}
            </button>
          ))}
        </span>
      )}
      <button
        type="button"
        className={style.hide}
        aria-label={hide.label}
        title={hide.label}
        onClick={hide.run}
      >
        <Cross />
      </button>
    </div>
  );
}
