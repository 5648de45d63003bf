/**
 * The cursor of a replay: where it stands, whether it plays, and the run as it was known there; and
 * the way from there to a dry-run that begins at that moment.
 */
import { useQueryClient } from "@tanstack/react-query";
import {
  type Dispatch,
  type RefObject,
  type SetStateAction,
  useCallback,
  useEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import { type ActionFrame, type Frame, type Replay, useReplayData } from "../api/review";
import type { ActionRun, Run } from "../api/runs";
import { tick } from "../clock/server-clock";
import { visitBegin } from "../status/progress";
import { instant } from "../ui/times";

export const REPLAY_SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16] as const;

export interface ReplayCursor<Shown extends Run | null = Run> {
  /** Milliseconds since 1970; null at the live edge, or at the end of what is over. */
  at: number | null;
  start: number;
  end: number;
  playing: boolean;
  speed: number;
  /** The replay is on its way. */
  waiting: boolean;
  failed: unknown;
  /** The run as it was known at the cursor. */
  run: Shown;
  player: ReplayPlayer | null;
  seek: (at: number | null) => void;
  play: (playing: boolean) => void;
  setSpeed: (speed: number) => void;
  step: (direction: 1 | -1) => void;
}

const AGAIN = 3_000; // ms between two requests for the replay of a run that goes on

/** The replay of a run that goes on is asked for again and again while somebody looks at it. */
function useAskedAgain(newest: Run | null, asked: boolean): void {
  const client = useQueryClient();
  const goes = newest?.ended_at === null;
  const id = newest?.id ?? "";
  useEffect(() => {
    if (!goes || !asked) return;
    const key = ["runs", "film", id];
    const timer = setInterval(() => void client.invalidateQueries({ queryKey: key }), AGAIN);
    return () => {
      clearInterval(timer);
      void client.invalidateQueries({ queryKey: key });
    };
  }, [goes, asked, client, id]);
}

/** Return the player of the replay, with the run as it was when the replay began. */
function usePlayer(
  data: ReturnType<typeof useReplayData>["data"],
  newest: Run | null,
): ReplayPlayer | null {
  const still = useRef(newest);
  const isOther = still.current?.id !== newest?.id || newest?.umrf !== still.current?.umrf;
  if (isOther) still.current = newest;
  return useMemo(
    () => (data && still.current !== null ? new ReplayPlayer(data, still.current) : null),
    [data],
  );
}

/** The run as it was known at the cursor. */
function useRunAt<Shown extends Run | null>(
  player: ReplayPlayer | null,
  at: number | null,
  newest: Shown,
): Shown {
  return useMemo(
    () => (at === null || player === null ? newest : (player.at(at) as Shown)),
    [at, player, newest],
  );
}

/** Moves the cursor while it plays, up to the edge. */
function useRunningTime(
  playing: boolean,
  speed: number,
  edge: RefObject<number>,
  setAt: Dispatch<SetStateAction<number | null>>,
  setPlaying: (playing: boolean) => void,
): void {
  useEffect(() => {
    if (!playing) return;
    let last = tick();
    let frame = requestAnimationFrame(function tick(now) {
      const passed = (now - last) * speed;
      last = now;
      setAt((before) => {
        if (before === null) return before;
        const next = before + passed;
        if (next < edge.current) return next;
        setPlaying(false);
        return null;
      });
      frame = requestAnimationFrame(tick);
    });
    return () => cancelAnimationFrame(frame);
  }, [playing, speed, edge, setAt, setPlaying]);
}

/**
 * Keeps the moment at which a replay stands. `newest`: the run as it is known now, null without one; `end`: the right
 * edge of its time.
 */
export function useReplay<Shown extends Run | null>(
  runner: string | undefined,
  newest: Shown,
  end: number,
  from: number | null,
): ReplayCursor<Shown> {
  const start = instant(newest?.requested_at) ?? instant(newest?.started_at) ?? end;
  const [at, setAt] = useState(from);
  const [playing, setPlaying] = useState(false);
  const [speed, setSpeed] = useState(1);
  const [chapter, setChapter] = useState(0);
  const asked = newest !== null && (at !== null || playing);
  const replay = useReplayData(runner, newest?.id ?? "", chapter, asked);
  useAskedAgain(newest, asked);
  const player = usePlayer(replay.data, newest);
  const chapters = replay.data?.chapters;
  useEffect(() => {
    if (at !== null && chapters) setChapter(chapterAt(chapters, at));
  }, [at, chapters]);

  const edge = useRef(end);
  edge.current = end;
  const seek = useCallback(
    (to: number | null) => {
      setAt(to === null || to >= edge.current ? null : Math.max(start, to));
      if (to === null) setPlaying(false);
    },
    [start],
  );
  const play = useCallback(
    (on: boolean) => {
      if (on) setAt((now) => now ?? start);
      setPlaying(on);
    },
    [start],
  );
  const step = useCallback(
    (direction: 1 | -1) => {
      setPlaying(false);
      if (direction === 1) {
        if (at === null) return;
        const next = player?.next(at) ?? null;
        const later = chapters?.find((each) => (instant(each.at) ?? 0) > at);
        seek(next ?? instant(later?.at) ?? null);
      } else {
        const here = at ?? edge.current;
        seek(player === null ? here - 1 : (player.previous(here) ?? start));
      }
    },
    [at, player, chapters, seek, start],
  );
  useRunningTime(playing, speed, edge, setAt, setPlaying);
  const run = useRunAt(player, at, newest);
  const waiting = asked && replay.isPending;
  const failed = asked ? replay.error : null;
  const commands = { seek, play, setSpeed, step };
  return { at, start, end, playing, speed, waiting, failed, run, player, ...commands };
}

const BLANK: ActionRun = { aid: null, state: "UNINITIALIZED", visits: [], older: 0, messages: [] };

function changed(action: ActionRun, frame: ActionFrame): ActionRun {
  const place = Math.max(0, frame.first - action.older);
  const kept = action.visits.slice(0, place);
  return {
    aid: frame.aid ?? action.aid,
    state: frame.state,
    // Visits before the first known one are only counted.
    older: Math.max(action.older, frame.first - kept.length),
    visits: [...kept, ...(frame.visits ?? [])],
    messages: frame.messages ? [...action.messages, ...frame.messages] : action.messages,
    ...(action.at_least ? { at_least: true } : {}),
  };
}

/** The run after one more frame. */
export function runAfter(run: Run, frame: Frame): Run {
  const next: Run = { ...run, ...frame.head };
  if (frame.alarms) next.alarms = [...run.alarms, ...frame.alarms];
  if (frame.actions) {
    const actions = { ...run.actions };
    for (const [name, action] of Object.entries(frame.actions)) {
      actions[name] = changed(actions[name] ?? BLANK, action);
    }
    next.actions = actions;
  }
  return next;
}

/** Returns a run as it was before its first event: everything that was sent, nothing that came of it. */
export function runBefore(run: Run): Run {
  const actions: Record<string, ActionRun> = {};
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    const missed = action.at_least ? { at_least: true } : {};
    if (action.aid !== null) actions[name] = { ...BLANK, aid: action.aid, ...missed };
  }
  return {
    ...run,
    state: "requested",
    desired: "running",
    result: null,
    proof_at: null,
    unknown_since: null,
    moves_again_at: null,
    started_at: null,
    ended_at: null,
    stopped_by: null,
    detail: "",
    alarms: [],
    actions,
  };
}

/** The number of frames that had happened by `at` (ms). */
export function framesBy(frames: readonly Frame[], at: number): number {
  let [low, high] = [0, frames.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((instant(frames[middle]?.at) ?? 0) <= at) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Return whether a frame changes anything that a person can see. */
export function shows(frame: Frame): boolean {
  return (
    Object.keys(frame.head ?? {}).length > 0 ||
    Object.keys(frame.actions ?? {}).length > 0 ||
    (frame.alarms?.length ?? 0) > 0
  );
}

/** A replay that can be asked for any number of its frames, quickly in any order. */
export class ReplayPlayer {
  readonly replay: Replay;
  private readonly known: Run[];

  constructor(replay: Replay, run: Run) {
    this.replay = replay;
    this.known = [replay.base ? { ...run, ...replay.base, umrf: run.umrf } : runBefore(run)];
  }

  /** The run after the first `count` frames of this page. */
  after(count: number): Run {
    const wanted = Math.min(Math.max(0, count), this.replay.frames.length);
    for (let i = this.known.length; i <= wanted; i += 1) {
      const before = this.known[i - 1] as Run;
      this.known.push(runAfter(before, this.replay.frames[i - 1] as Frame));
    }
    return this.known[wanted] as Run;
  }

  at(time: number): Run {
    return this.after(framesBy(this.replay.frames, time));
  }

  /** Return the time of the next visible change; null if this page has none. */
  next(time: number): number | null {
    const { frames } = this.replay;
    for (let i = framesBy(frames, time); i < frames.length; i += 1) {
      const frame = frames[i] as Frame;
      if (shows(frame)) return instant(frame.at);
    }
    return null;
  }

  /** Return the time of the last visible change before `time`; null if this page has none. */
  previous(time: number): number | null {
    const { frames } = this.replay;
    for (let i = framesBy(frames, time - 1) - 1; i >= 0; i -= 1) {
      const frame = frames[i] as Frame;
      const at = instant(frame.at);
      if (shows(frame) && at !== null && at < time) return at;
    }
    return null;
  }
}

/** The page of a replay in which `time` lies: how many events come before it. */
export function chapterAt(chapters: Replay["chapters"], time: number): number {
  let after = 0;
  for (const chapter of chapters) {
    if ((instant(chapter.at) ?? 0) <= time) after = chapter.after;
  }
  return after;
}

/**
 * ms after the start: where the replay stands, `at`; at the end of a run its last action had just
 * begun. Null while nothing has begun.
 */
export function dryRunMoment(run: Run, at: number | null): number | null {
  const start = instant(run.started_at);
  if (start === null) return null;
  if (at !== null) return Math.max(0, Math.round(at - start));
  const begun = Object.values(run.actions ?? {}).flatMap(({ visits }) =>
    visits.map((visit) => visitBegin(visit) ?? start),
  );
  return begun.length === 0 ? null : Math.max(0, Math.round(Math.max(...begun) - start));
}

export function dryRunUrl(graph: string, run: string, moment: number): string {
  const query = new URLSearchParams({ rehearse: run, t: String(moment) });
  return `/graphs/${graph}?${query}`;
}

/** The moment of a run that an address asks for; null where it asks for none. */
export function askedDryRun(search: string): { run: string; t: number } | null {
  const query = new URLSearchParams(search);
  const run = query.get("rehearse");
  const t = Number(query.get("t") ?? "");
  return run !== null && run !== "" && Number.isFinite(t) && t >= 0 ? { run, t } : null;
}
