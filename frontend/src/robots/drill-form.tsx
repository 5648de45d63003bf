/** Says what a person saw in a Stop drill: with which run it was made, and whether the robot stopped. */
import { Button, Group, Modal, SegmentedControl, Select, Stack, Text } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link } from "wouter";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import type { ListedRun } from "../api/review";
import { recordDrill } from "../api/rights";
import type { Robot } from "../api/robots";
import { useRuns } from "../api/runs";
import { serverNow } from "../clock/server-clock";
import { clock, day, instant } from "../ui/times";
import { isolated } from "../words/isolated";

const DAY_MS = 24 * 3600 * 1000;

/** `Run 12 of patrol, today 12:30:05`. */
function runWords({ number, graph_name, requested_at }: ListedRun): string {
  const at = instant(requested_at) ?? 0;
  return `Run ${number} of ${isolated(graph_name)}, ${day(at, serverNow())} ${clock(at)}`;
}

/** Return the runs of the last day with which a drill of a robot can be recorded, newest first. */
export function drillRuns(runs: readonly ListedRun[], robot: Robot, now: number): ListedRun[] {
  const known = new Set(robot.drills.map(({ run }) => run));
  return runs.filter(
    (run) =>
      run.engine === robot.name &&
      !run.simulated &&
      run.stopped_by !== null &&
      !known.has(run.id) &&
      now - (instant(run.requested_at) ?? 0) < DAY_MS,
  );
}

interface QuestionProps {
  label: string;
  value: string;
  onChange: (value: string) => void;
}

function Question({ label, value, onChange }: QuestionProps) {
  return (
    <div>
      <Text size="sm" mb={4}>
        {label}
      </Text>
      <SegmentedControl
        fullWidth
        aria-label={label}
        value={value}
        onChange={onChange}
        data={[
          { value: "", label: "Not said" },
          { value: "yes", label: "Yes" },
          { value: "no", label: "No" },
        ]}
      />
    </div>
  );
}

export function DrillForm({ robot, onClose }: { robot: Robot; onClose: () => void }) {
  const { runner } = useLive();
  const client = useQueryClient();
  const runs = drillRuns(useRuns(runner).data ?? [], robot, serverNow());
  const [chosen, setChosen] = useState<string | null>(null);
  const run = chosen ?? runs[0]?.id ?? null;
  const [saw, setSaw] = useState("");
  const [hardware, setHardware] = useState("");
  const record = useMutation({
    mutationFn: async () => {
      if (run === null) return;
      const said = { saw_it_stop: saw === "yes", hardware_stop: hardware === "yes" };
      await recordDrill(runner ?? "", robot.name, { run, ...said });
      await client.invalidateQueries({ queryKey: ["robots"] });
    },
    onSuccess: onClose,
  });
  const which = isolated(robot.name);
  return (
    <Modal
      opened
      onClose={onClose}
      title={`Record a Stop drill of ${which}`}
      closeButtonProps={{ "aria-label": "Close" }}
    >
      <form
        onSubmit={(event) => {
          event.preventDefault();
          record.mutate();
        }}
      >
        <Stack gap="md">
          <Text size="sm">
            Start a graph that keeps {which} moving for some seconds, press Stop while it moves, and
            try its hardware stop, too. The runner takes the time from your press to the proof from
            that run.
          </Text>
          {runs.length === 0 ? (
            <Text size="sm" role="status">
              No run on {which} was stopped within the last day. <Link to="/">Choose a graph</Link>{" "}
              to start there.
            </Text>
          ) : (
            <Select
              label="The run that was stopped"
              allowDeselect={false}
              data={runs.map((each) => ({ value: each.id, label: runWords(each) }))}
              value={run}
              onChange={setChosen}
            />
          )}
          <Question label={`Did you see ${which} stop?`} value={saw} onChange={setSaw} />
          <Question
            label="Did you try its hardware stop?"
            value={hardware}
            onChange={setHardware}
          />
          <Text size="sm" c="dimmed">
            A “no”, or a Stop without a proof, is kept as a failed drill.
          </Text>
          {record.isError && (
            <Text c="var(--error)" role="alert">
              {errorText(record.error)}
            </Text>
          )}
          <Group justify="flex-end">
            <Button onClick={onClose}>Cancel</Button>
            <Button
              type="submit"
              variant="filled"
              loading={record.isPending}
              disabled={run === null || saw === "" || hardware === ""}
            >
              Record
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  );
}
