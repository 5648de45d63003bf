import { useEffect, useState } from "react";
import { useVersions } from "../../api/graphs";
import { errorText } from "../../api/http";
import { CONDUCTED } from "../../api/led-runs";
import { SIMULATOR } from "../../api/robots";
import type { Run } from "../../api/runs";
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
