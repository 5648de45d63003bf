/** The cursor of a replay: where it stands, whether it plays, and the run as it was known there. */

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
import { useReplayData } from "../../api/documents/replay";
import type { Run } from "../../api/runs";
import { tick } from "../../clock/server-clock";
import { instant } from "../../ui/times";
import { chapterAt, ReplayPlayer } from "./replay";

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

/** What plays the replay, with the run as it was when its replay began. */
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

/** `newest`: the run as it is known now, null without one; `end`: the right edge of its time. */
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
