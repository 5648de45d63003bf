/** Questions of a run to people, and what they can do in it at a place that is chosen on its canvas. */
import { useLive } from "../api/page-link";
import type { Run } from "../api/runs";
import { RunQuestions } from "../status/held-notice";
import { asksPeople } from "../status/rests";
import { RunPoint } from "../status/run-point";
import { useSentGraph } from "./sent-graph";

interface Props {
  run: Run;
  /** The chosen action or arrow; null for none, and while the past is shown. */
  point: string | null;
}

export function RunSteering({ run, point }: Props) {
  const { now } = useLive();
  const graph = useSentGraph(run)?.graph ?? null;
  return (
    <>
      {asksPeople(run, now.engines) && <RunQuestions run={run} />}
      <RunPoint run={run} graph={graph} id={point} />
    </>
  );
}
