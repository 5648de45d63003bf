/** What of a replay stands on the time axis, and what its marks say in words. */
import type { Replay, ReplayMark } from "../../api/documents/replay";
import type { Run } from "../../api/runs";
import type { TimeGap, TimeSign } from "../../status/lanes/timeline";
import { clock, instant } from "../../ui/times";
import { isolated } from "../../words/isolated";

const SIGNS: Record<string, TimeSign["tone"]> = {
  "run.stop_requested.v1": "stopped",
  "run.pause_requested.v1": "stopped",
  "run.resume_requested.v1": "run",
  "run.modify_requested.v1": "run",
  "run.modify_refused.v1": "error",
  "run.proof.v1": "true",
  "run.alarm_raised.v1": "error",
  "run.moves_again.v1": "error",
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
      return `${isolated(by)} let it go on`;
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
