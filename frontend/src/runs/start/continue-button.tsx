/** Continues a led run from its head: the look before that start. */
import { Button } from "@mantine/core";
import { IconPlayerSkipForward } from "@tabler/icons-react";
import { useState } from "react";
import { useVersions, versionName } from "../../api/graphs";
import { CONDUCTED } from "../../api/led-runs";
import { useMay } from "../../api/people";
import type { Run } from "../../api/runs";
import { canContinue, openedIn } from "../../status/earlier-list";
import { lazyPart, OverlayBoundary } from "../../ui/lazy-part";

const StartDialog = lazyPart(() => import("./start-dialog").then((part) => part.StartDialog));

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
              ...openedIn(run),
            }}
            onChosen={() => undefined}
            onClose={() => setAsking(false)}
          />
        </OverlayBoundary>
      )}
    </>
  );
}
