/** Asks for one fault, and starts the run once more with it, in the simulator. */
import { Button, Modal, Select, Stack, Text } from "@mantine/core";
import { useState } from "react";
import { errorText } from "../../api/http";
import type { InjectedFault } from "../../api/review";
import type { Run } from "../../api/runs";
import { actionWords } from "../../status/level-words";
import { Segments } from "../../ui/segments";
import { type Repeated, type RepeatedVersion, repeatRun } from "./repeat-run";

const FAULTS: { value: InjectedFault; label: string }[] = [
  { value: "error", label: "It ends in error" },
  { value: "false", label: "It ends false" },
  { value: "hang", label: "It never ends and ignores Stop" },
  { value: "init_error", label: "It fails while it is made ready" },
];

interface Props {
  runner: string | undefined;
  run: Run;
  onDone: (repeated: Repeated) => void;
  onClose: () => void;
}

export function FaultDialog({ runner, run, onDone, onClose }: Props) {
  const actions = Object.keys(run.actions ?? {});
  const [which, setWhich] = useState<RepeatedVersion>("same");
  const [action, setAction] = useState<string | null>(actions[0] ?? null);
  const [fault, setFault] = useState<string | null>("error");
  const [refused, setRefused] = useState("");
  const start = async () => {
    const chosen = FAULTS.find((each) => each.value === fault);
    if (runner === undefined || action === null || chosen === undefined) return;
    try {
      const done = await repeatRun(runner, run, which, { action, fault: chosen.value });
      onClose();
      onDone(done);
    } catch (error) {
      setRefused(errorText(error));
    }
  };
  return (
    <Modal opened onClose={onClose} title="Run again with one fault" centered>
      <Stack gap="sm">
        <Text size="sm" c="dimmed">
          In the simulator: everything goes as it did in run {run.number}, except this.
        </Text>
        {run.graph !== null && (
          <Segments
            label="Version"
            data={[
              { value: "same", label: "This version" },
              { value: "newest", label: "The newest one" },
            ]}
            value={which}
            onChange={setWhich}
          />
        )}
        <Select
          label="Action"
          data={actions.map((value) => ({ value, label: actionWords(run, value) }))}
          value={action}
          onChange={setAction}
          searchable
          allowDeselect={false}
        />
        <Select
          label="Fault"
          data={FAULTS}
          value={fault}
          onChange={setFault}
          allowDeselect={false}
        />
        {refused !== "" && (
          <Text size="sm" c="red" role="alert">
            {refused}
          </Text>
        )}
        <Button onClick={() => void start()} disabled={action === null}>
          Run in the simulator
        </Button>
      </Stack>
    </Modal>
  );
}
