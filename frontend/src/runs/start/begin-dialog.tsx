/** The looks before starts that do not begin at the entry, from a run and from the canvas. */
import { Button } from "@mantine/core";
import { IconPlayerSkipForward } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { useVersions, versionName } from "../../api/graphs";
import { errorText } from "../../api/http";
import { CONDUCTED } from "../../api/led-runs";
import { useMay } from "../../api/people";
import { SIMULATOR } from "../../api/robots";
import type { Run } from "../../api/runs";
import { canContinue, isOpened } from "../../status/earlier-list";
import { lazyPart, OverlayBoundary } from "../../ui/lazy-part";
import { nextLabel, notifyFailure } from "./use-start";

const StartDialog = lazyPart(() => import("./start-dialog").then((part) => part.StartDialog));

interface BeginProps {
  graph: string;
  name: string;
  /** The name of the moment on screen. */
  settle: () => Promise<number>;
  /** The reason why this moment cannot be started; null when it can. */
  obstacle: string | null;
  at: readonly string[];
  only: boolean;
  /** The newest run of the graph, whose outcomes and values count if it was led and is over. */
  run: Run | null | undefined;
  onClose: () => void;
}

/** The look before a run of a part of the graph on screen. */
export function BeginDialog({ graph, name, settle, obstacle, onClose, ...part }: BeginProps) {
  const versions = useVersions(graph).data ?? [];
  const [seq, setSeq] = useState<number | null>(null);
  // The part is pinned when it is asked for: a run that ends meanwhile changes nothing.
  const [{ at, only, run }] = useState(part);
  // biome-ignore lint/correctness/useExhaustiveDependencies: the version is pinned once, when the dialog opens
  useEffect(() => {
    let gone = false;
    const fail = (why: string) => {
      if (gone) return;
      notifyFailure("Not started", why);
      onClose();
    };
    if (obstacle !== null) fail(obstacle);
    else
      settle().then(
        (found) => !gone && setSeq(found),
        (error) => fail(errorText(error)),
      );
    return () => {
      gone = true;
    };
  }, []);
  if (seq === null) return null;
  const known = run?.robots && run.ended_at !== null ? run : null;
  return (
    <OverlayBoundary>
      <StartDialog
        graph={graph}
        name={name}
        seq={seq}
        label={nextLabel(versions, seq)}
        chosen={known ? [CONDUCTED] : [SIMULATOR]}
        robots={known?.robots}
        beginning={{ run: known?.id ?? "", number: known?.number ?? 0, at, only }}
        onChosen={() => undefined}
        onClose={onClose}
      />
    </OverlayBoundary>
  );
}

/** Offers to continue a led run that ended, where it ended. */
export function ContinueButton({ run }: { run: Run }) {
  const may = useMay(run.simulated ? "simulate" : "operate");
  const graph = run.graph ?? "";
  const versions = useVersions(graph, run.version).data ?? [];
  const version = versions.find(({ id }) => id === run.version);
  const [asking, setAsking] = useState(false);
  if (!may || !canContinue(run) || version === undefined) return null;
  return (
    <>
      <Button
        size="compact-xs"
        variant="light"
        flex="none"
        leftSection={<IconPlayerSkipForward size={14} aria-hidden />}
        onClick={() => setAsking(true)}
      >
        Continue …
      </Button>
      {asking && (
        <OverlayBoundary>
          <StartDialog
            graph={graph}
            name={run.graph_name}
            seq={version.seq}
            label={versionName(versions, version.id)}
            chosen={[CONDUCTED]}
            robots={run.robots}
            values={run.values}
            beginning={{
              run: run.id,
              number: run.number,
              at: [],
              only: false,
              ...(isOpened(run) && { opened: version.id }),
            }}
            onChosen={() => undefined}
            onClose={() => setAsking(false)}
          />
        </OverlayBoundary>
      )}
    </>
  );
}
