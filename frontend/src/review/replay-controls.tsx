/** The controls of a replay: scrub, play, step, speed. */
import { ActionIcon, Button, Loader, NativeSelect, Slider } from "@mantine/core";
import {
  IconPlayerPauseFilled,
  IconPlayerPlayFilled,
  IconPlayerSkipBack,
  IconPlayerTrackNext,
  IconPlayerTrackPrev,
} from "@tabler/icons-react";
import { type ReactNode, useEffect, useRef } from "react";
import type { Replay, ReplayMark } from "../api/review";
import type { Run } from "../api/runs";
import type { TimeGap, TimeSign } from "../status/lanes/timeline";
import { keyOf } from "../ui/keys";
import { clock, duration, instant } from "../ui/times";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import { REPLAY_SPEEDS, type ReplayCursor } from "./replay";
import style from "./replay-controls.module.css";

interface Props {
  replay: ReplayCursor;
  goes: boolean;
  /** Controls for the moment at which the replay stands. */
  children?: ReactNode;
}

/** Space plays, arrows step, Home and End go to the ends: wherever nobody is typing. */
function usePlayerKeys(replay: ReplayCursor): void {
  const now = useRef(replay);
  now.current = replay;
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const typed =
        "input, textarea, select, [role=slider], [role=tab], [role=dialog], [role=menu]";
      const key = keyOf(event);
      const own = key === " " ? `button, a, ${typed}` : typed;
      const taken = event.target instanceof HTMLElement && event.target.closest(own) !== null;
      if (taken || event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
      const { seek, play, step, playing, start } = now.current;
      const handler = new Map<string, () => void>([
        [" ", () => play(!playing)],
        ["ArrowRight", () => step(1)],
        ["ArrowLeft", () => step(-1)],
        ["Home", () => seek(start)],
        ["End", () => seek(null)],
      ]).get(key);
      if (handler === undefined) return;
      event.preventDefault();
      handler();
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
}

export function PlayerControls({ replay, goes, children }: Props) {
  const { at, start, end, playing, speed, seek, play, step } = replay;
  usePlayerKeys(replay);
  const here = at ?? end;
  const span = Math.max(1, end - start);
  const live = goes && at === null;
  return (
    <section className={style.player} aria-label="Replay">
      <Tooltip label="To the start (Home)">
        <ActionIcon aria-label="To the start" onClick={() => seek(start)}>
          <IconPlayerSkipBack size={16} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Tooltip label="The change before (←)">
        <ActionIcon aria-label="The change before" onClick={() => step(-1)}>
          <IconPlayerTrackPrev size={16} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Tooltip label={playing ? "Pause (Space)" : "Play (Space)"}>
        <ActionIcon
          variant="filled"
          className={style.play ?? ""}
          aria-label={playing ? "Pause the replay" : "Play the replay"}
          onClick={() => play(!playing)}
        >
          {playing ? (
            <IconPlayerPauseFilled size={15} aria-hidden />
          ) : (
            <IconPlayerPlayFilled size={15} aria-hidden />
          )}
        </ActionIcon>
      </Tooltip>
      <Tooltip label="The next change (→)">
        <ActionIcon aria-label="The next change" disabled={at === null} onClick={() => step(1)}>
          <IconPlayerTrackNext size={16} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Slider
        className={style.slider ?? ""}
        size="sm"
        label={null}
        thumbLabel="Moment of the run"
        min={0}
        max={span}
        step={Math.max(1, span / 1000)}
        value={Math.min(span, Math.max(0, here - start))}
        onChange={(value) => seek(start + value)}
      />
      <span className={style.time} data-testid="replay-time">
        {replay.waiting ? <Loader size={12} aria-label="Loading the replay" /> : null}
        <b className="ink weight-600">{duration(Math.max(0, here - start))}</b> / {duration(span)}
      </span>
      <NativeSelect
        className={style.speed ?? ""}
        size="xs"
        aria-label="Speed of the replay"
        value={String(speed)}
        onChange={(event) => replay.setSpeed(Number(event.currentTarget.value))}
        data={REPLAY_SPEEDS.map((each) => ({ value: String(each), label: `${each}×` }))}
      />
      <Button
        className={style.edge ?? ""}
        size="compact-xs"
        variant={at === null ? "light" : "subtle"}
        aria-pressed={at === null}
        onClick={() => seek(null)}
      >
        {goes ? (live ? "Live" : "Back to live") : "End"}
      </Button>
      {children}
    </section>
  );
}

const SIGNS: Record<string, TimeSign["tone"]> = {
  "run.stop_requested.v1": "stopped",
  "run.pause_requested.v1": "stopped",
  "run.resume_requested.v1": "run",
  "run.modify_requested.v1": "run",
  "run.modify_refused.v1": "error",
  "run.proof.v1": "true",
  "run.alarm_raised.v1": "error",
  "run.moves_again.v1": "error",
  "run.held.v1": "stopped",
  "run.released.v1": "run",
};

/** Words for each reason of the runner for closing a question. */
const UNANSWERED: Readonly<Record<string, string>> = {
  lapsed: " and is asked again",
  held: ", since the run waits; it is asked again",
  deadline: ": nobody answered in time",
  restarted: ": the runner was restarted",
  stopped: ": the run or its action was stopped",
};

/** A mark in one sentence; empty for what needs none. */
export function markText(mark: Pick<ReplayMark, "kind" | "by" | "text" | "since">): string {
  const by = mark.by || "somebody";
  const text = mark.text ? `: ${mark.text}` : "";
  switch (mark.kind) {
    case "run.requested.v1":
      return `${isolated(by)} asked for the start${mark.text ? ` in spite of problems: “${mark.text}”` : ""}`;
    case "run.published.v1":
      return "The start message was sent";
    case "run.stop_requested.v1":
      return `${isolated(by)} pressed Stop`;
    case "run.pause_requested.v1":
      return `${isolated(by)} asked for a pause`;
    case "run.resume_requested.v1":
      return `${isolated(by)} resumed the run`;
    case "run.modify_requested.v1":
      return `${isolated(by)} sent another version`;
    case "run.modify_refused.v1":
      return `The other version was not taken${text}`;
    case "run.stop_sent.v1":
      return `Stop message${text}`;
    case "run.proof.v1":
      return "Proven: nothing runs any more";
    case "run.silent.v1":
      return `No answer since ${clock(instant(mark.since) ?? 0)}${text}`;
    case "run.answered.v1":
      return "The engine answers again";
    case "run.alarm_raised.v1":
      return mark.text ?? "Alarm";
    case "run.held.v1":
      return `Nothing further begins${text}`;
    case "run.released.v1":
      return `${isolated(by)} let it go on${text}`;
    case "run.handed_over.v1":
      return `${isolated(by)} handed the run over to ${isolated(mark.text ?? "somebody")}`;
    case "run.breakpoints_set.v1":
      return `${isolated(by)} set its breakpoints: ${mark.text || "none"}`;
    case "run.question_asked.v1":
      return `A person is asked${text}`;
    case "run.question_answered.v1":
      return `${isolated(by)} answered${text}`;
    case "run.question_closed.v1":
      return `The question closed without an answer${UNANSWERED[mark.text ?? ""] ?? text}`;
    case "run.ended.v1":
      return `The run is over${text}`;
    default:
      return mark.text ?? "";
  }
}

export function timelineSignsOf(replay: Replay | undefined): TimeSign[] {
  return (replay?.marks ?? []).flatMap((mark) => {
    const tone = SIGNS[mark.kind];
    const at = instant(mark.at);
    return tone === undefined || at === null ? [] : [{ at, tone, text: markText(mark) }];
  });
}

/** Times in which the engine gave no answer. An end that nothing proves leaves the last one open. */
export function silentTimesOf(replay: Replay | undefined, run: Run, until: number): TimeGap[] {
  const gaps: TimeGap[] = [];
  let since: { at: number; text: string } | null = null;
  for (const mark of replay?.marks ?? []) {
    const at = instant(mark.at);
    if (mark.kind === "run.silent.v1") {
      since ??= { at: instant(mark.since) ?? at ?? 0, text: markText(mark) };
    } else if (mark.kind === "run.answered.v1" && since !== null && at !== null) {
      gaps.push({ from: since.at, until: at, text: since.text });
      since = null;
    }
  }
  const open = run.state === "lost" || run.state === "unknown";
  if (since !== null && open) gaps.push({ from: since.at, until, text: since.text });
  return gaps;
}
