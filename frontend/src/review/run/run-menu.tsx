/** A run once more: on its robots, or in the simulator, as it went or with one fault; expected from now on. */
import { Button, Menu, Modal, Stack, Text, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconBug,
  IconChevronDown,
  IconPlayerPlay,
  IconPlayerTrackNext,
  IconRepeat,
  IconShieldCheck,
} from "@tabler/icons-react";
import { useState } from "react";
import { useLocation } from "wouter";
import { expectRun } from "../../api/documents/courses";
import { graphMoment } from "../../api/documents/texts";
import { useVersions, versionName } from "../../api/graphs";
import { errorText } from "../../api/http";
import type { Run } from "../../api/runs";
import { isolated } from "../../words/isolated";
import { FaultDialog } from "./fault-dialog";
import { type Repeated, type RepeatedVersion, repeatRun } from "./repeat-run";
import style from "./run-page.module.css";

/** A start like any other one, that begins with what a run had. */
export interface RepeatActions {
  graph: string;
  name: string;
  seq: number;
  engines: readonly string[];
}

interface Props {
  runner: string | undefined;
  run: Run;
}

interface MenuProps extends Props {
  /** Engines of the run, and of those that were started with it. */
  engines: readonly string[];
  onStart: (again: RepeatActions) => void;
}

function ExpectDialog({ runner, run, onClose }: Props & { onClose: () => void }) {
  const [name, setName] = useState(`${run.graph_name}, as in run ${run.number}`);
  const [refused, setRefused] = useState("");
  const save = async () => {
    if (runner === undefined) return;
    try {
      await expectRun(runner, run.id, name);
      onClose();
      notifications.show({
        title: "Expected from now on",
        message:
          "The tests of the graph tell when it would go another way, and so does each start.",
      });
    } catch (error) {
      setRefused(errorText(error));
    }
  };
  return (
    <Modal opened onClose={onClose} title="Expect this course" centered>
      <Stack gap="sm">
        <Text size="sm" c="dimmed">
          Keeps the graph, what every action did, and the course they took. Later versions of the
          graph or of this program are checked against it, without a robot.
        </Text>
        <TextInput
          label="Name"
          value={name}
          maxLength={100}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        {refused !== "" && (
          <Text size="sm" c="red" role="alert">
            {refused}
          </Text>
        )}
        <Button onClick={() => void save()} disabled={name.trim() === ""}>
          Save
        </Button>
      </Stack>
    </Modal>
  );
}

interface RepeatItemsProps {
  disabled: boolean;
  hasGraph: boolean;
  onSimulate: (which: RepeatedVersion) => void;
  onFault: () => void;
}

function RepeatItems({ disabled, hasGraph, onSimulate, onFault }: RepeatItemsProps) {
  return (
    <>
      <Menu.Label>Repeat in the simulator</Menu.Label>
      <Menu.Item
        leftSection={<IconRepeat size={15} aria-hidden />}
        disabled={disabled}
        onClick={() => onSimulate("same")}
      >
        As it went
      </Menu.Item>
      {hasGraph && (
        <Menu.Item
          leftSection={<IconRepeat size={15} aria-hidden />}
          disabled={disabled}
          onClick={() => onSimulate("newest")}
        >
          As it went, with the newest version
        </Menu.Item>
      )}
      <Menu.Item
        leftSection={<IconBug size={15} aria-hidden />}
        disabled={disabled}
        onClick={onFault}
      >
        With one fault …
      </Menu.Item>
    </>
  );
}

export function RunMenu({ runner, run, engines, onStart }: MenuProps) {
  const [, go] = useLocation();
  const [dialog, setDialog] = useState<"fault" | "expect" | null>(null);
  const over = run.ended_at !== null;
  const ran = Object.values(run.actions ?? {}).some((action) => action.visits.length > 0);
  const graph = run.graph ?? "";
  const versions = useVersions(graph, run.version).data ?? [];
  const version = versions.find((each) => each.id === run.version);
  const where = engines.map(isolated).join(", ");
  const complain = (error: unknown) =>
    notifications.show({ color: "red", title: "Not started", message: errorText(error) });
  const show = ({ run: fresh, doubts }: Repeated) => {
    go(`/runs/${fresh}`);
    if (doubts.length === 0) return;
    const told = doubts.slice(0, 3).map(({ action, text }) => `${action}: ${text}`);
    const more = doubts.length > 3 ? [`and ${doubts.length - 3} more`] : [];
    notifications.show({
      title: "Not everything was known",
      message: [...told, ...more].join(" "),
      autoClose: 12_000,
    });
  };
  const simulate = (which: RepeatedVersion) => {
    if (runner !== undefined) repeatRun(runner, run, which).then(show, complain);
  };
  const start = (seq: number) => onStart({ graph, name: run.graph_name, seq, engines });
  const startNewest = () => graphMoment(graph).then(({ seq }) => start(seq), complain);
  const close = () => setDialog(null);
  return (
    <>
      <Menu position="bottom-end" withinPortal>
        <Menu.Target>
          <Button
            variant="default"
            leftSection={<IconRepeat size={15} aria-hidden />}
            rightSection={<IconChevronDown size={14} aria-hidden />}
            className={style.again ?? ""}
            aria-label="Run again"
          >
            <span className={style.word}>Run again</span>
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          {graph !== "" && (
            <>
              <Menu.Label>Start on {where}</Menu.Label>
              <Menu.Item
                leftSection={<IconPlayerPlay size={15} aria-hidden />}
                disabled={version === undefined}
                onClick={() => version && start(version.seq)}
              >
                {version ? versionName(versions, version.id) : "This version"} again …
              </Menu.Item>
              <Menu.Item
                leftSection={<IconPlayerTrackNext size={15} aria-hidden />}
                onClick={() => void startNewest()}
              >
                The newest version …
              </Menu.Item>
            </>
          )}
          <RepeatItems
            disabled={!over || !ran}
            hasGraph={graph !== ""}
            onSimulate={simulate}
            onFault={() => setDialog("fault")}
          />
          <Menu.Label>From now on</Menu.Label>
          <Menu.Item
            leftSection={<IconShieldCheck size={15} aria-hidden />}
            disabled={!over || !ran}
            onClick={() => setDialog("expect")}
          >
            Expect this course …
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      {dialog === "fault" && (
        <FaultDialog runner={runner} run={run} onDone={show} onClose={close} />
      )}
      {dialog === "expect" && <ExpectDialog runner={runner} run={run} onClose={close} />}
    </>
  );
}
