/** A run of a graph that the reader may not see: its robots, its state, who started it, and Stop. */

import { Button } from "@mantine/core";
import { IconEyeOff, IconSquareFilled } from "@tabler/icons-react";
import { engineWords } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { useCurrentName } from "../api/people";
import { hasEnded } from "../api/run-stop";
import type { Run } from "../api/runs";
import { runPlace } from "../api/runs";
import { useRunStatus } from "../status/progress";
import { RestList } from "../status/rest-list";
import { StateLabel } from "../status/state-label";
import { clock, day, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./hidden-run.module.css";

function StopProof({ run }: { run: Run }) {
  const by = useCurrentName(run.stopped_by ?? run.author);
  const proven = instant(run.proof_at);
  return (
    <>
      {run.stopped_by !== null && <p className="m-0">Stopped by {isolated(by)}.</p>}
      {proven !== null && (
        <p className="m-0">An answer of the engine proved at {clock(proven)} that nothing moves.</p>
      )}
      {run.alarms.map(({ code, text }) => (
        <p key={code} className="m-0 ink-error weight-550" role="alert">
          {text}
        </p>
      ))}
    </>
  );
}

export function HiddenRun({ run }: { run: Run }) {
  const { live } = useLive();
  const by = useCurrentName(run.author);
  const now = useNow(30_000);
  const start = instant(run.started_at ?? run.requested_at);
  return (
    <section className={style.card} aria-label={`Run ${run.number}`}>
      <h2 className={style.title}>
        <IconEyeOff size={18} aria-hidden /> A run of a graph that you may not see
      </h2>
      <p className="m-0">
        <StateLabel {...useRunStatus(run)} pill /> on <b>{isolated(runPlace(run))}</b>
      </p>
      <p className="m-0 ink2">
        Started by {isolated(by)}
        {start !== null && `, ${day(start, now)} ${clock(start)}`}.
      </p>
      <RestList run={run} />
      <StopProof run={run} />
      {!hasEnded(run) && (
        <Button
          className={style.stop}
          variant="filled"
          color="red"
          leftSection={<IconSquareFilled size={11} aria-hidden />}
          onClick={() => live?.stop(run.id)}
        >
          Stop {isolated(engineWords(run))}
        </Button>
      )}
      <p className="m-0 quiet-xs">
        Owners say who may see a graph, and can show you this run. Everybody may stop it.
      </p>
    </section>
  );
}
