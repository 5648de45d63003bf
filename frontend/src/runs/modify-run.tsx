/** Gives the running robot what is on screen: offered where changing a running graph is safe. */
import { Button, Modal, Text } from "@mantine/core";
import { IconArrowRight, IconMinus, IconPencil, IconPlus, IconSend } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { queryKeys, useVersions } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/live/use-live";
import type { Robot } from "../api/robots";
import { abilitiesOf, modifyRun, type Run } from "../api/runs";
import { useMay } from "../api/use-person";
import type { MeaningDifference } from "../graph/meaning";
import { HoldButton } from "../ui/floating/hold-button";
import style from "./modify-run.module.css";
import { nextLabel, notifyFailure, publishedVersion } from "./start/use-start";

interface Props {
  run: Run;
  /** The version that runs. */
  label: string;
  found: readonly MeaningDifference[];
  seq: number;
  settle: () => Promise<number>;
  obstacle: string | null;
}

const SIGNS = { added: IconPlus, removed: IconMinus, changed: IconPencil } as const;
const MOST = 40; // differences that are listed

/** Why a running graph cannot be changed; null when it can. */
function modifyObstacle(run: Run, engine: Robot | undefined, obstacle: string | null) {
  const where = run.simulated ? "the simulator" : run.engine;
  if (run.state !== "running" && run.state !== "paused") return `Run ${run.number} is ${run.state}`;
  if (run.desired === "stopped") return `Run ${run.number} is being stopped`;
  if (engine?.pauses !== true) {
    return `Changing it pauses it, and pausing is not safe on ${where}: stop it and start anew`;
  }
  return obstacle;
}

function List({ found }: { found: readonly MeaningDifference[] }) {
  const more = found.length - MOST;
  return (
    <>
      <ul className={style.list} aria-label="What becomes different">
        {found.slice(0, MOST).map(({ kind, what, details }) => {
          const Sign = SIGNS[kind];
          return (
            <li key={`${kind} ${what}`} data-kind={kind}>
              <Sign size={14} aria-hidden />
              <span>
                {what} <i>{kind}</i>
                {details.map((detail) => (
                  <span key={detail} className={style.detail}>
                    {detail}
                  </span>
                ))}
              </span>
            </li>
          );
        })}
      </ul>
      {more > 0 && <Text c="dimmed">and {more} more</Text>}
    </>
  );
}

export function ModifyRun({ run, label, found, seq, settle, obstacle }: Props) {
  const { runner, now } = useLive();
  const client = useQueryClient();
  const [asking, setAsking] = useState<number | null>(null);
  const may = useMay(run.simulated ? "simulate" : "operate");
  const versions = useVersions(run.graph ?? "").data ?? [];
  const why = modifyObstacle(
    run,
    now.engines.find((each) => each.name === abilitiesOf(run)),
    now.link === "down" ? "The runner does not answer" : obstacle,
  );
  const where = run.simulated ? "the simulator" : run.engine;
  const send = useMutation({
    mutationFn: async (at: number) => {
      const graph = run.graph ?? "";
      const { version, umrf } = await publishedVersion(graph, at);
      void client.invalidateQueries({ queryKey: queryKeys.versions(graph) });
      return modifyRun(runner ?? "", run.id, { id: version.id, digest: version.digest, umrf });
    },
    onSuccess: () => setAsking(null),
    onError: (error) => notifyFailure("Not sent", errorText(error)),
  });
  if (!may) return null;
  const ask = () =>
    void settle().then(setAsking, (error) => notifyFailure("Not sent", errorText(error)));
  const next = nextLabel(versions, asking ?? seq);
  return (
    <>
      <Button
        size="compact-xs"
        variant="subtle"
        leftSection={<IconSend size={13} aria-hidden />}
        disabled={why !== null}
        title={why ?? `Send what is on screen to run ${run.number}, as it runs`}
        aria-label={why === null ? "Send to the running robot …" : `Send: ${why}`}
        onClick={ask}
      >
        Send …
      </Button>
      {asking !== null && (
        <Modal
          opened
          onClose={() => setAsking(null)}
          title={`Change run ${run.number} while it goes`}
          closeButtonProps={{ "aria-label": "Close" }}
        >
          <p className={style.what}>
            <b>{label}</b> <IconArrowRight size={15} aria-label="becomes" /> <b>{next}</b> on{" "}
            {where}
          </p>
          <List found={found} />
          <Text size="sm" c="dimmed">
            The engine pauses the graph, takes this one in its place and goes on. Actions that run
            now are paused meanwhile. Stop works all the while.
          </Text>
          <footer className={style.foot}>
            <Button onClick={() => setAsking(null)}>Cancel</Button>
            <HoldButton
              icon={<IconSend size={13} aria-hidden />}
              label={why ?? (send.isPending ? "Sending …" : "Hold to send")}
              name={why === null ? `Send ${next} to run ${run.number} on ${where}` : why}
              question={`Change run ${run.number} on ${where} to exactly ${next}?`}
              disabled={why !== null || send.isPending}
              onHeld={() => send.mutate(asking)}
            />
          </footer>
        </Modal>
      )}
    </>
  );
}
