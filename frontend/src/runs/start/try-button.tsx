/** Runs a graph that has never run in the simulator by one press, and shows the run on its canvas. */
import { Button } from "@mantine/core";
import { IconPlayerPlayFilled } from "@tabler/icons-react";
import { useLocation } from "wouter";
import type { GraphSummary } from "../../api/graphs";
import { useLive } from "../../api/page-link";
import { useMay } from "../../api/people";
import { SIMULATOR } from "../../api/robots";
import { isolated } from "../../words/isolated";
import { useStart } from "./use-start";

export function TryButton({ graph: { id, name, seq } }: { graph: GraphSummary }) {
  const may = useMay("simulate");
  const { now } = useLive();
  const [, go] = useLocation();
  const start = useStart(id);
  if (!may || now.link !== "live") return null;
  // The run takes the place of this button, so a callback of the mutation would be lost with it.
  const onClick = () =>
    void start.mutateAsync({ seq, engines: [SIMULATOR], digest: null }).then(
      ({ runs }) => runs.length > 0 && go(`/graphs/${id}`),
      () => {}, // told by the mutation
    );
  return (
    <Button
      size="compact-sm"
      variant="light"
      leftSection={<IconPlayerPlayFilled size={12} aria-hidden />}
      aria-label={`Try ${isolated(name)} in the simulator: nothing moves`}
      title="Run it in the simulator: nothing moves"
      loading={start.isPending}
      onClick={onClick}
    >
      Try
    </Button>
  );
}
