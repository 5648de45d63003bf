/** A run at any moment of its replay: what was known then, and nothing that was learned later. */
import type { ActionFrame, Frame, Replay } from "../../api/documents/replay";
import type { ActionRun, Run } from "../../api/runs";
import { instant } from "../../ui/times";

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

/** Before its first event: everything that was sent, nothing that came of it. */
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

/** Whether a person would see anything change. */
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

  /** When the next change that can be seen happens; null when none is in this page. */
  next(time: number): number | null {
    const { frames } = this.replay;
    for (let i = framesBy(frames, time); i < frames.length; i += 1) {
      const frame = frames[i] as Frame;
      if (shows(frame)) return instant(frame.at);
    }
    return null;
  }

  /** When the last visible change before `time` happened; null when none is in this page. */
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
