/** Start: publishes what is on screen and sends exactly that to the runner. */
import { notifications } from "@mantine/notifications";
import { IconPlayerPlayFilled } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { keys, publish, useVersions, type Version, versionName } from "../api/graphs";
import { place, sentence } from "../api/http";
import { memberText } from "../api/member";
import { startRun } from "../api/runs";
import { openRuns, useLive } from "../api/use-live";
import { newAid } from "../graph/ids";
import { HoldButton } from "../ui/hold-button";

interface Props {
  graph: string;
  /** The moment that the page shows. */
  seq: number;
  /** Why this moment cannot be started; null when it can. */
  obstacle: string | null;
  compact?: boolean;
}

/** The name that a start of this moment will have. */
export function nextLabel(versions: readonly Version[], seq: number): string {
  const same = versions.find((version) => version.seq === seq);
  return same ? versionName(versions, same.id) : `v${versions.length + 1}`;
}

export function useStart(graph: string) {
  const { live, runner } = useLive();
  const client = useQueryClient();
  return useMutation({
    mutationFn: async (seq: number) => {
      if (runner === undefined) throw new Error("The runner is not known yet.");
      const text = await publish(graph, seq);
      const version = JSON.parse(text) as Version;
      void client.invalidateQueries({ queryKey: keys.versions(graph) });
      const umrf = memberText(text, "umrf");
      if (umrf === null) throw new Error("The editor gave no graph with the version.");
      const run = await startRun({
        runner,
        version: version.id,
        digest: version.digest,
        umrf,
        graph,
        engine: "simulator",
        request: newAid(),
      });
      live?.learn(run);
      return run;
    },
    onError: (error) => {
      const where = place(error);
      notifications.show({
        color: "red",
        title: "Not started",
        message: where === "" ? sentence(error) : `${sentence(error)} (${where})`,
        autoClose: 12_000,
      });
    },
  });
}

export function StartControl({ graph, seq, obstacle, compact = false }: Props) {
  const versions = useVersions(graph).data ?? [];
  const { now } = useLive();
  const start = useStart(graph);
  const label = nextLabel(versions, seq);
  const goes = openRuns(now).some((run) => run.graph === graph);
  const why = start.isPending
    ? "Starting …"
    : now.link === "down"
      ? "The runner does not answer"
      : obstacle;
  return (
    <HoldButton
      icon={<IconPlayerPlayFilled size={13} aria-hidden />}
      label={start.isPending ? "Starting …" : compact ? `Start ${label}` : `Start ${label} …`}
      name={why === null ? `Start ${label} in the simulator` : `Start ${label}: ${why}`}
      question={
        goes
          ? `A run of this graph goes already. Start ${label} beside it, in the simulator?`
          : `Start exactly ${label}, as it is on screen, in the simulator?`
      }
      disabled={why !== null}
      onHeld={() => start.mutate(seq)}
    />
  );
}
