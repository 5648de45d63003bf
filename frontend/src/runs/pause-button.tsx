/** Pause and go on: offered only where the engine makes it safe. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconPlayerPause, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { errorText } from "../api/http";
import { useLive } from "../api/live/use-live";
import { abilitiesOf, pauseOrResume, type Run } from "../api/runs";
import { useMay } from "../api/use-person";

export function PauseButton({ run }: { run: Run }) {
  const { runner, now } = useLive();
  const may = useMay(run.simulated ? "simulate" : "operate");
  const engine = now.engines.find((each) => each.name === abilitiesOf(run));
  const paused = run.desired === "paused";
  const steer = useMutation({
    mutationFn: () => pauseOrResume(runner ?? "", run.id, paused ? "resume" : "pause"),
    onError: (error) => {
      const title = paused ? "It does not go on" : "Not paused";
      notifications.show({ color: "red", title, message: errorText(error) });
    },
  });
  const goes = run.state === "running" || run.state === "paused";
  if (!may || engine?.pauses !== true || !goes || run.desired === "stopped") return null;
  const Sign = paused ? IconPlayerPlay : IconPlayerPause;
  return (
    <Button
      size="compact-xs"
      leftSection={<Sign size={13} aria-hidden />}
      loading={steer.isPending}
      onClick={() => steer.mutate()}
    >
      {paused ? "Go on" : "Pause"}
    </Button>
  );
}
