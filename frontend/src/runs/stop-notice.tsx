/** What became of a Stop, in words, until it is proven. */
import { CloseButton } from "@mantine/core";
import { useState } from "react";
import type { LiveNow, StopAsked } from "../api/live";
import type { Run } from "../api/runs";
import { openRuns, useLive } from "../api/use-live";
import { duration, useNow } from "../ui/when";
import style from "./stop-notice.module.css";

const LOUD = 2_500; // ms without proof until the notice shouts
const GONE = 6_000; // ms that a proven stop stays to be read

type Notice = { tone: "quiet" | "loud" | "done"; text: string } | null;

function targets(stop: StopAsked, now: LiveNow): Run[] {
  if (stop.run !== "all") {
    const run = now.runs.get(stop.run);
    return run ? [run] : [];
  }
  return [...now.runs.values()].filter(
    (run) => run.ended_at === null || Date.parse(run.ended_at) >= stop.at,
  );
}

/** Never says "stopped" without the runs' own state saying so. */
export function noticeOf(stop: StopAsked, now: LiveNow, at: number): Notice {
  const waited = at - stop.at;
  const since = `asked ${duration(waited)} ago`;
  if (stop.state === "refused") return { tone: "loud", text: `Stop refused: ${stop.detail}` };
  if (stop.state === "unheard" && now.link !== "live") {
    return { tone: "loud", text: `Stop did not reach the runner: ${stop.detail} Press it again.` };
  }
  if (now.link === "down") {
    return { tone: "loud", text: `STOP UNCONFIRMED, ${since}: no word from the runner.` };
  }
  const runs = targets(stop, now);
  const open = runs.filter((run) => run.ended_at === null);
  if (open.length > 0) {
    const names = open.map((run) => `run ${run.number}`).join(", ");
    if (waited < LOUD) return { tone: "quiet", text: `Stopping ${names} … ${since}` };
    return {
      tone: "loud",
      text: `STOP UNCONFIRMED: ${names} not proven to have stopped, ${since}.`,
    };
  }
  if (waited > GONE) return null;
  if (stop.state === "asked") return { tone: "quiet", text: `Stop ${since}` };
  if (runs.length === 0) return { tone: "done", text: "The runner says that nothing runs." };
  const ends = runs.map((run) => `Run ${run.number}: ${run.state}`).join(" · ");
  return { tone: "done", text: `${ends}.` };
}

export function StopNotice() {
  const { now } = useLive();
  const [dismissed, setDismissed] = useState("");
  const last = now.stops.at(-1);
  const watching = last !== undefined && last.id !== dismissed;
  const open = openRuns(now).length;
  const at = useNow(200, watching && (open > 0 || Date.now() - last.at < GONE + 1000));
  if (!watching) return null;
  const notice = noticeOf(last, now, at);
  if (notice === null) return null;
  return (
    <div
      className={style.notice}
      data-tone={notice.tone}
      role={notice.tone === "loud" ? "alert" : "status"}
    >
      <span>{notice.text}</span>
      <CloseButton size="sm" aria-label="Hide" onClick={() => setDismissed(last.id)} />
    </div>
  );
}
