/** State of a run at this moment, wherever it is listed: unknown while the runner is not heard. */

import type { LiveState } from "../api/live-socket";
import { useLive } from "../api/page-link";
import type { Run } from "../api/runs";
import { serverTimeOf } from "../clock/server-clock";
import { runEndText, runLabel, type Tone, unknownStatus } from "./progress";

export type Heard = Pick<LiveState, "link" | "since">;

/** In a word, as it is counted. What has ended stays so, whoever is heard. Pure. */
export function runStatus(run: Run, { link, since }: Heard): { tone: Tone; word: string } {
  if (run.ended_at === null && link === "down") {
    return unknownStatus(serverTimeOf(since));
  }
  return runLabel(run);
}

/** Return the state of a run; for an end also who or what caused it. */
export function useRunStatus(run: Run): { tone: Tone; word: string } {
  const { now } = useLive();
  const { tone, word } = runStatus(run, now);
  return { tone, word: run.ended_at === null ? word : runEndText(run) };
}
