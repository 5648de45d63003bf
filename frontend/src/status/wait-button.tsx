/** Makes a led run wait before its next action. It is no stop: what was begun goes on. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconHandStop } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { errorText, isOutcomeUnknown } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { letWait } from "../api/presses";
import type { Run } from "../api/runs";

/** True if a run can wait: it is led action by action, and goes on. */
export function canWait(run: Run): boolean {
  const goes = run.ended_at === null && run.desired === "running" && !run.held;
  return goes && Boolean(run.robots);
}

function failure(error: unknown, run: Run) {
  const unknown = isOutcomeUnknown(error);
  const title = unknown ? `NOT KNOWN whether run ${run.number} waits` : "The run does not wait";
  return { color: "red", title, message: errorText(error), ...(unknown && { autoClose: false }) };
}

export function WaitButton({ run }: { run: Run }) {
  const { live, runner, now } = useLive(run.id);
  const may = useMay(run.simulated ? "simulate" : "operate");
  const wait = useMutation({
    mutationFn: () => letWait(runner ?? "", run.id),
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error, run)),
  });
  if (!may || !canWait(run)) return null;
  const words = "Begin no further action; what was begun goes on";
  return (
    <Button
      size="compact-xs"
      leftSection={<IconHandStop size={13} aria-hidden />}
      loading={wait.isPending}
      disabled={now.link === "down"}
      title={now.link === "down" ? "The runner does not answer" : words}
      onClick={() => wait.mutate()}
    >
      Wait
    </Button>
  );
}
