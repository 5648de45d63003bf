/** Words for the connection to the runner, and for the age of what the page shows of a run. */

import { IconEye, IconPlugConnectedX } from "@tabler/icons-react";
import { runnerWords } from "../api/http";
import { enginesOf } from "../api/led-runs";
import { silentSites, siteWith } from "../api/live-socket";
import { useLive, useOldestAnswerOf, useRunSeenAt } from "../api/page-link";
import { SIMULATOR } from "../api/robots";
import type { Run } from "../api/runs";
import { serverTimeOf } from "../clock/server-clock";
import { clock, duration, useNow } from "../ui/times";
import style from "./connection-status.module.css";

const OLD = 2_500; // ms; a run is looked at each second

/**
 * "proof 0.4 s ago": when the engine itself last showed this run; of a led run, when the robot that is
 * silent for longest last answered. `whose`: its name stands before.
 */
function LastSeen({ run, whose = false }: { run: Run; whose?: boolean }) {
  const own = useRunSeenAt(run.id);
  const oldest = useOldestAnswerOf(
    run.robots ? enginesOf(run).filter((engine) => engine !== SIMULATOR) : [],
  );
  const seen = run.robots ? oldest : own;
  const goes = run.ended_at === null;
  const present = useNow(500, goes);
  if (!goes) return null;
  if (seen === undefined) return <span className={style.word}>no proof yet</span>;
  const old = Math.max(0, present - seen);
  return (
    <span
      className={style.word}
      data-old={old > OLD || undefined}
      title={
        run.robots
          ? "When the robot that is silent for longest last answered"
          : "When the engine itself last showed this run"
      }
    >
      <IconEye size={13} aria-hidden /> {whose && <b>{enginesOf(run).join(", ")}</b>} proof{" "}
      {duration(old)} ago
    </span>
  );
}

/**
 * Says nothing while all is well and no robot moves. `alone`: the editor does not answer, so it is said that the
 * robots still do.
 */
export function ConnectionStatus({
  run,
  whose = false,
  alone = false,
}: {
  run?: Run | null;
  whose?: boolean;
  alone?: boolean;
}) {
  const { now: all } = useLive();
  const site = run ? siteWith(all, run.id) : silentSites(all)[0];
  const now = site?.state ?? all;
  const who = runnerWords(site?.site.name);
  if (now.link === "live") {
    return (
      <span className="inline-flex gap-40">
        {run && run.ended_at === null && !run.simulated && <LastSeen run={run} whose={whose} />}
        {alone && (
          <span className={style.word} data-link="live">
            <i aria-hidden /> Robots live
          </span>
        )}
      </span>
    );
  }
  if (now.link === "connecting")
    return <span className={style.word}>Connecting to {who.replace("The", "the")} …</span>;
  return (
    <span className={style.word} data-link="down" role="status">
      <IconPlugConnectedX size={13} aria-hidden /> {who.replace("The runner", "Runner")} unknown
      since {clock(serverTimeOf(now.since))}
    </span>
  );
}
