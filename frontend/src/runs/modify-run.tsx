/** Gives the running robot what is on screen: offered where changing a running graph is safe. */
import { Button, Modal, Text } from "@mantine/core";
import { IconArrowRight, IconMinus, IconPencil, IconPlus, IconSend } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { queryKeys, useVersions } from "../api/graphs";
import { fetchDocument } from "../api/history";
import { errorText, isOutcomeUnknown } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { modifyRun } from "../api/presses";
import type { Robot } from "../api/robots";
import { abilitiesOf, type Run, type Watching } from "../api/runs";
import { mapsFrom } from "../graph/document-keys";
import { differences, type MeaningDifference } from "../graph/meaning";
import type { Graph } from "../graph/model";
import { readGraph } from "../graph/read";
import { useWatching, WatchTicks } from "../status/watching";
import { HoldButton } from "../ui/hold-button";
import style from "./modify-run.module.css";
import { nextLabel, notifyFailure, publishedVersion } from "./start/use-start";

interface Props {
  run: Run;
  /** The version that runs. */
  label: string;
  running: Graph;
  settle: () => Promise<number>;
  obstacle: string | null;
}

/** The graph that a person looked at: exactly this is sent, whatever others change meanwhile. */
interface LookedAt {
  readonly seq: number;
  /** The version that the run had then; differences are counted from it. */
  readonly version: string | null;
  readonly label: string;
  readonly found: readonly MeaningDifference[];
}

const SIGNS = { added: IconPlus, removed: IconMinus, changed: IconPencil } as const;
const MOST = 40; // differences that are listed
const PATIENCE = 10_000; // ms for the graph as it was at the moment that is sent

/** Return why a running graph cannot be changed; null when it can. */
function modifyObstacle(run: Run, engine: Robot | undefined, obstacle: string | null) {
  const where = run.simulated ? "the simulator" : run.engine;
  if (run.state !== "running" && run.state !== "paused") return `Run ${run.number} is ${run.state}`;
  if (run.desired === "stopped") return `Run ${run.number} is being stopped`;
  if (engine?.pauses !== true) {
    return `Changing a run pauses it, and pausing is not safe on ${where}: stop the run and start again`;
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
                  <span key={detail} className="block ink2 text-sm">
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

/** The moment that is on screen, as the server has it, beside what runs. */
async function looked({ run, label, running, settle }: Props): Promise<LookedAt> {
  const seq = await settle();
  const document = await fetchDocument(run.graph ?? "", seq, AbortSignal.timeout(PATIENCE));
  const found = differences(running, readGraph(mapsFrom(document)));
  if (found.length === 0) throw new Error("The running graph is the one on screen.");
  return { seq, version: run.version, label, found };
}

/** The runner may have taken it all the same. */
class Unanswered extends Error {}

/** Publishes that moment and sends it, once. */
async function sent(
  runner: string,
  run: Run,
  seq: number,
  watching: Watching,
  onVersion: () => void,
): Promise<Run> {
  const { version, umrf } = await publishedVersion(run.graph ?? "", seq);
  onVersion();
  try {
    return await modifyRun(
      runner,
      run.id,
      { id: version.id, digest: version.digest, umrf },
      watching,
    );
  } catch (error) {
    throw isOutcomeUnknown(error) ? new Unanswered(errorText(error)) : error;
  }
}

interface DialogProps {
  run: Run;
  asking: LookedAt;
  /** The reason why it cannot be sent now; null when it can. */
  obstacle: string | null;
  onClose: () => void;
}

const NOBODY: readonly string[] = [];

function SendDialog({ run, asking, obstacle, onClose }: DialogProps) {
  const { runner } = useLive();
  const client = useQueryClient();
  const graph = run.graph ?? "";
  const next = nextLabel(useVersions(graph).data ?? [], asking.seq);
  const where = run.simulated ? "the simulator" : run.engine;
  const told = () => void client.invalidateQueries({ queryKey: queryKeys.versions(graph) });
  const watch = useWatching(run.simulated ? NOBODY : [run.engine]);
  const send = useMutation({
    mutationFn: () => sent(runner ?? "", run, asking.seq, watch.watching, told),
    onSuccess: onClose,
    onError: (error) => {
      if (!(error instanceof Unanswered)) return notifyFailure("Not sent", errorText(error));
      notifyFailure(
        "NOT KNOWN whether it was sent",
        `${error.message} The run may go on with the new graph.`,
      );
      onClose();
    },
    onSettled: watch.forget,
  });
  const other = run.version !== asking.version;
  const why = other
    ? "Another version was sent meanwhile: check again"
    : (watch.obstacle ?? obstacle);
  return (
    <Modal
      opened
      onClose={onClose}
      title={`Change run ${run.number} while it goes`}
      closeButtonProps={{ "aria-label": "Close" }}
    >
      <p className={style.what}>
        <b>{asking.label}</b> <IconArrowRight size={15} aria-label="becomes" /> <b>{next}</b> on{" "}
        {where}
      </p>
      <List found={asking.found} />
      <Text size="sm" c="dimmed">
        The engine pauses the running graph, replaces it by this one and goes on. Actions that run
        now are paused meanwhile. Stop works all the while.
      </Text>
      <WatchTicks watch={watch} />
      <footer className={style.foot}>
        <Button onClick={onClose}>Cancel</Button>
        <HoldButton
          icon={<IconSend size={13} aria-hidden />}
          label={why ?? (send.isPending ? "Sending …" : "Hold to send")}
          name={why === null ? `Send ${next} to run ${run.number} on ${where}` : why}
          question={`Change run ${run.number} on ${where} to exactly ${next}?`}
          disabled={why !== null || send.isPending}
          onHeld={() => send.mutate()}
        />
      </footer>
    </Modal>
  );
}

export function ModifyRun(props: Props) {
  const { run, obstacle } = props;
  const { now } = useLive(run.id);
  const may = useMay(run.simulated ? "simulate" : "operate");
  const [asking, setAsking] = useState<LookedAt | null>(null);
  const look = useMutation({
    mutationFn: () => looked(props),
    onSuccess: setAsking,
    onError: (error) => notifyFailure("Not sent", errorText(error)),
  });
  const why = modifyObstacle(
    run,
    now.engines.find((each) => each.name === abilitiesOf(run)),
    now.link === "down" ? "The runner does not answer" : obstacle,
  );
  if (!may) return null;
  return (
    <>
      <Button
        size="compact-xs"
        variant="subtle"
        leftSection={<IconSend size={13} aria-hidden />}
        loading={look.isPending}
        disabled={why !== null}
        title={why ?? `Send what is on screen to run ${run.number}, as it runs`}
        aria-label={why === null ? "Send to the running robot …" : `Send: ${why}`}
        onClick={() => look.mutate()}
      >
        Send …
      </Button>
      {asking !== null && (
        <SendDialog run={run} asking={asking} obstacle={why} onClose={() => setAsking(null)} />
      )}
    </>
  );
}
