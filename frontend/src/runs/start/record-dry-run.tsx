/** Makes a dry-run a run: started in the simulator, with the same decisions, and recorded. */
import { IconPlayerPlayFilled } from "@tabler/icons-react";
import type { Script } from "../../api/dry-runs";
import { useVersions } from "../../api/graphs";
import { useLive } from "../../api/page-link";
import { SIMULATOR } from "../../api/robots";
import type { StartValues } from "../../api/starts";
import { StartButton } from "./start-button";
import { nextLabel, useStart } from "./use-start";

interface Props {
  graph: string;
  seq: number;
  obstacle: string | null;
  /** Outcomes that were chosen in the dry-run. */
  script: Script;
  /** Values that were given in the dry-run. */
  values: StartValues;
  /** The start is on its way: the dry-run may go. */
  onStarted: () => void;
}

export function RecordDryRun({ graph, seq, obstacle, script, values, onStarted }: Props) {
  const versions = useVersions(graph).data ?? [];
  const { now } = useLive();
  const start = useStart(graph);
  const label = nextLabel(versions, seq);
  const why = now.link === "down" ? "The runner does not answer" : obstacle;
  return (
    <StartButton
      size="compact-sm"
      icon={<IconPlayerPlayFilled size={12} aria-hidden />}
      label="Run in the simulator"
      name={
        why === null
          ? `Run in the simulator: ${label}, as decided here; it is recorded`
          : `Run in the simulator: ${why}`
      }
      question={null}
      disabled={why !== null || start.isPending}
      onStart={() =>
        start.mutate(
          { seq, engines: [SIMULATOR], digest: null, script, values },
          { onSuccess: onStarted },
        )
      }
    />
  );
}
