/** Pause and go on: offered only where the engine makes it safe. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconPlayerPause, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { errorText, isOutcomeUnknown } from "../api/http";
import { useLive } from "../api/live/use-live";
import { abilitiesOf, pauseOrResume, type Run } from "../api/runs";
import { useMay } from "../api/use-person";

/** Nobody has answered: it may have been done all the same. */
function failure(error: unknown, paused: boolean) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) {
    return { color: "red", title: paused ? "It does not go on" : "Not paused", message };
  }
  return {
    color: "red",
    autoClose: false as const,
    title: `NOT KNOWN whether it ${paused ? "goes on" : "pauses"}`,
    message: `${message} The robot may ${paused ? "move" : "go on"}.`,
  };
}

export function PauseButton({ run }: { run: Run }) {
  const { runner, now } = useLive();
  const may = useMay(run.simulated ? "simulate" : "operate");
  const engine = now.engines.find((each) => each.name === abilitiesOf(run));
  const paused = run.desired === "paused";
  const steer = useMutation({
    mutationFn: () => pauseOrResume(runner ?? "", run.id, paused ? "resume" : "pause"),
    onError: (error) => notifications.show(failure(error, paused)),
  });
  const goes = run.state === "running" || run.state === "paused";
  if (!may || engine?.pauses !== true || !goes || run.desired === "stopped") return null;
  const Sign = paused ? IconPlayerPlay : IconPlayerPause;
  return (
    <Button
      size="compact-xs"
      leftSection={<Sign size={13} aria-hidden />}
      loading={steer.isPending}
      disabled={now.link === "down"}
      title={now.link === "down" ? "The runner does not answer" : undefined}
      onClick={() => steer.mutate()}
    >
      {paused ? "Go on" : "Pause"}
    </Button>
  );
}
