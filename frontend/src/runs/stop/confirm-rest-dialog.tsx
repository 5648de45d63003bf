/** Ends a run by a person's word, and says first what that means. */

import { Button, Modal, NativeSelect, Text, TextInput } from "@mantine/core";
import { IconEye } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { errorText } from "../../api/http";
import { engineWords } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { confirmRest, type Run } from "../../api/runs";
import { actionWords, spokenIn } from "../../status/level-places";
import { openRests } from "../../status/rests";
import { usePendingText } from "../../ui/drafts";
import { HoldButton } from "../../ui/hold-button";
import { isolated } from "../../words/isolated";
import { notifyFailure } from "../start/use-start";
import style from "./confirm-rest-dialog.module.css";

const SHORTEST = 3; // characters, as the runner asks for

interface Props {
  run: Run;
  /** The robot of a led run that was looked at, if that is known. */
  robot?: string | undefined;
  opened: boolean;
  onClose: () => void;
}

export function ConfirmRestDialog({ run, robot, opened, onClose }: Props) {
  const { runner } = useLive();
  const [how, setHow] = useState("");
  // A led run is confirmed robot by robot.
  const pieces = openRests(run);
  const [chosen, choose] = useState<string | null>(null);
  const piece =
    pieces.find((each) => each.piece === chosen) ??
    pieces.find((each) => each.robot === robot) ??
    pieces[0];
  const where = piece === undefined ? engineWords(run) : isolated(piece.robot);
  // Never kept for later: these words are about what was seen a moment ago.
  usePendingText(opened ? how : "", null);
  const confirm = useMutation({
    mutationFn: () => confirmRest(runner ?? "", piece?.piece ?? run.id, how.trim()),
    onSuccess: onClose,
    onError: (error) => notifyFailure("Not confirmed", errorText(error)),
  });
  const said = how.trim().length >= SHORTEST;
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title={`Is ${where} at rest?`}
      closeButtonProps={{ "aria-label": "Close" }}
      zIndex={300}
    >
      <Text size="sm">
        Nothing that the engine says can show whether run {run.number} of{" "}
        <bdi>{run.graph_name}</bdi> has come to rest:{" "}
        {spokenIn(run, piece?.why || run.unconfirmed || "it does not answer").replace(/\.$/, "")}.
      </Text>
      <Text size="sm" mt="xs">
        Only somebody who has looked at the robot can end this. Until then nothing is started there.
      </Text>
      {pieces.length > 1 && (
        <NativeSelect
          mt="md"
          label="Which robot?"
          value={piece?.piece ?? ""}
          data={pieces.map((each) => ({
            value: each.piece ?? "",
            label: `${isolated(each.robot)}: ${actionWords(run, each.action ?? "")}`,
          }))}
          onChange={(event) => choose(event.currentTarget.value)}
        />
      )}
      <TextInput
        mt="md"
        data-autofocus
        label="How did you see that nothing moves?"
        placeholder="I stand beside it; its motors are off"
        maxLength={500}
        value={how}
        onChange={(event) => setHow(event.currentTarget.value)}
      />
      <Text size="xs" c="dimmed" mt="xs">
        Your name, the time and these words are kept with the run. It counts as ended in error,
        without a proof.
      </Text>
      <footer className={style.foot}>
        <Button onClick={onClose}>Cancel</Button>
        <HoldButton
          icon={<IconEye size={14} aria-hidden />}
          label={confirm.isPending ? "Confirming …" : "Hold to confirm"}
          name={said ? `Confirm that run ${run.number} is at rest` : "Say how you saw it first"}
          question={`Has ${where} come to rest, and have you seen it?`}
          disabled={!said || confirm.isPending}
          onHeld={() => confirm.mutate()}
        />
      </footer>
    </Modal>
  );
}
