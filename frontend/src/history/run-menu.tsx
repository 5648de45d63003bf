/** What can be done with a run that was: run it again, compare it, hand it over, expect it. */
import { Button, Menu, Modal, Select, Stack, Text, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconArrowsDiff,
  IconBug,
  IconChevronDown,
  IconDownload,
  IconPlayerPlay,
  IconRepeat,
  IconShieldCheck,
} from "@tabler/icons-react";
import { useState } from "react";
import { useLocation } from "wouter";
import { askText, sentence } from "../api/http";
import { expectRun, exportUrl, type Fault, scriptOf, umrfUrl } from "../api/review";
import { type Run, startRun } from "../api/runs";
import style from "./run-page.module.css";

const FAULTS: { value: Fault; label: string }[] = [
  { value: "error", label: "It ends in error" },
  { value: "false", label: "It ends false" },
  { value: "hang", label: "It never ends and ignores Stop" },
  { value: "init_error", label: "It fails while it is made ready" },
];

interface Props {
  runner: string | undefined;
  run: Run;
}

/** Starts what ran, in the simulator, with actions that do what they did then. */
async function again(
  runner: string,
  run: Run,
  fault?: { action: string; fault: Fault },
): Promise<string> {
  const [umrf, script] = await Promise.all([
    askText(umrfUrl(runner, run.id)),
    scriptOf(runner, run.id, fault),
  ]);
  const started = await startRun({
    runner,
    version: run.version ?? "",
    digest: run.digest,
    umrf,
    graph: run.graph ?? "",
    engines: ["simulator"],
    request: crypto.getRandomValues(new Uint32Array(4)).join("-"),
    script: { behaviours: script.behaviours },
  });
  return started.runs[0]?.id ?? "";
}

function FaultDialog({ runner, run, onClose }: Props & { onClose: () => void }) {
  const [, go] = useLocation();
  const actions = Object.keys(run.actions ?? {});
  const [action, setAction] = useState<string | null>(actions[0] ?? null);
  const [fault, setFault] = useState<string | null>("error");
  const [refused, setRefused] = useState("");
  const start = async () => {
    const chosen = FAULTS.find((each) => each.value === fault);
    if (runner === undefined || action === null || chosen === undefined) return;
    try {
      const fresh = await again(runner, run, { action, fault: chosen.value });
      onClose();
      go(`/runs/${fresh}`);
    } catch (error) {
      setRefused(sentence(error));
    }
  };
  return (
    <Modal opened onClose={onClose} title="Run again with one fault" centered>
      <Stack gap="sm">
        <Text size="sm" c="dimmed">
          In the simulator: everything goes as it did in run {run.number}, except this.
        </Text>
        <Select
          label="Action"
          data={actions}
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
        message: "“action-assistant runs verify” tells when it would go another way.",
      });
    } catch (error) {
      setRefused(sentence(error));
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

export function RunMenu({ runner, run }: Props) {
  const [, go] = useLocation();
  const [dialog, setDialog] = useState<"fault" | "expect" | null>(null);
  const over = run.ended_at !== null;
  const ran = Object.values(run.actions ?? {}).some((action) => action.visits.length > 0);
  const repeat = async () => {
    if (runner === undefined) return;
    try {
      go(`/runs/${await again(runner, run)}`);
    } catch (error) {
      notifications.show({ color: "red", title: "Not started", message: sentence(error) });
    }
  };
  const file = (format: "jsonl" | "csv" | "mcap") =>
    runner === undefined ? undefined : exportUrl(runner, run.id, format);
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
            aria-label="Again"
          >
            <span className={style.word}>Again</span>
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Label>In the simulator</Menu.Label>
          <Menu.Item
            leftSection={<IconPlayerPlay size={15} aria-hidden />}
            disabled={!over || !ran}
            onClick={() => void repeat()}
          >
            As it went
          </Menu.Item>
          <Menu.Item
            leftSection={<IconBug size={15} aria-hidden />}
            disabled={!over || !ran}
            onClick={() => setDialog("fault")}
          >
            With one fault …
          </Menu.Item>
          <Menu.Label>Look closer</Menu.Label>
          <Menu.Item
            leftSection={<IconArrowsDiff size={15} aria-hidden />}
            onClick={() => go(`/runs/compare?b=${encodeURIComponent(run.id)}`)}
          >
            Compare with …
          </Menu.Item>
          <Menu.Item
            leftSection={<IconShieldCheck size={15} aria-hidden />}
            disabled={!over || !ran}
            onClick={() => setDialog("expect")}
          >
            Expect this course …
          </Menu.Item>
          <Menu.Label>Hand over</Menu.Label>
          {(
            [
              ["jsonl", "Every event (JSON lines)"],
              ["csv", "Intervals (CSV)"],
              ["mcap", "For Foxglove (MCAP)"],
            ] as const
          ).map(([format, label]) => (
            <Menu.Item
              key={format}
              component="a"
              href={file(format)}
              leftSection={<IconDownload size={15} aria-hidden />}
            >
              {label}
            </Menu.Item>
          ))}
        </Menu.Dropdown>
      </Menu>
      {dialog === "fault" && <FaultDialog runner={runner} run={run} onClose={close} />}
      {dialog === "expect" && <ExpectDialog runner={runner} run={run} onClose={close} />}
    </>
  );
}
