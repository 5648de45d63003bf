/** A run once more: on its robots, or in the simulator, as it went or with one fault; expected from now on. */
import { Button, Menu, Modal, Select, Stack, Text, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconBug,
  IconChevronDown,
  IconPlayerPlay,
  IconPlayerSkipForward,
  IconPlayerTrackNext,
  IconRepeat,
  IconShieldCheck,
} from "@tabler/icons-react";
import { useState } from "react";
import { useLocation } from "wouter";
import { expectRun } from "../api/courses";
import { graphMoment, publish, useVersions, type Version, versionName } from "../api/graphs";
import { errorText, fetchText } from "../api/http";
import { insideOf } from "../api/inside";
import { CONDUCTED, engineWords } from "../api/led-runs";
import { type InjectedFault, recordedScriptFor, recordedScriptOf, umrfUrl } from "../api/review";
import { SIMULATOR } from "../api/robots";
import { getRun } from "../api/run-stop";
import { type Inside, type Run, type StartOrder, startRun } from "../api/runs";
import { memberText } from "../graph/json-members";
import { type Beginning, canContinue, isOpened, openedIn } from "../status/earlier-list";
import { actionWords } from "../status/level-places";
import { Segments } from "../ui/segments";
import { isolated } from "../words/isolated";
import style from "./run-page.module.css";

/** A start like any other one, that begins with what a run had. */
export interface RepeatActions {
  graph: string;
  name: string;
  seq: number;
  engines: readonly string[];
  /** The engine of each actor; of a led run. */
  robots?: Run["robots"];
  values?: Run["values"] | undefined;
  /** Set for a run that had opened its sub-graphs. */
  opens?: boolean;
  /** The place where it begins, if not at the entry. */
  beginning?: Beginning | undefined;
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
          "The tests of the graph, and each start, report when a run would take another course.",
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
  const where = run.robots ? engineWords(run) : engines.map(isolated).join(", ");
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
  const opens = isOpened(run);
  const same = { engines, robots: run.robots, values: run.values, opens };
  const again = { graph, name: run.graph_name, ...same };
  const start = (seq: number) => onStart({ ...again, seq });
  const beginning = { run: run.id, number: run.number, at: [], only: false, ...openedIn(run) };
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
              {canContinue(run) && (
                <Menu.Item
                  leftSection={<IconPlayerSkipForward size={15} aria-hidden />}
                  disabled={version === undefined}
                  onClick={() => version && onStart({ ...again, seq: version.seq, beginning })}
                >
                  Continue where it ended …
                </Menu.Item>
              )}
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

const FAULTS: { value: InjectedFault; label: string }[] = [
  { value: "error", label: "It ends in error" },
  { value: "false", label: "It ends false" },
  { value: "hang", label: "It never ends and ignores Stop" },
  { value: "init_error", label: "It fails while it loads" },
];

interface FaultDialogProps {
  runner: string | undefined;
  run: Run;
  onDone: (repeated: Repeated) => void;
  onClose: () => void;
}

function FaultDialog({ runner, run, onDone, onClose }: FaultDialogProps) {
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

export type RepeatedVersion = "same" | "newest";

interface Injected {
  action: string;
  fault: InjectedFault;
}

export interface Repeated {
  run: string;
  /** Facts that the run did not tell, for which the script had to choose. */
  doubts: readonly { action: string; text: string }[];
}

interface SentGraph {
  version: string;
  digest: string;
  umrf: string;
  inside: Inside;
  values?: NonNullable<Run["values"]>;
}

/** Read a version as the editor writes it. */
function readVersion(text: string): SentGraph {
  const version = JSON.parse(text) as Version;
  const umrf = memberText(text, "umrf");
  if (umrf === null) throw new Error("The editor gave no graph with the version.");
  return { version: version.id, digest: version.digest, umrf, inside: insideOf(version) };
}

/** The graph as it is now, with the values of a run. */
async function newestOf(graph: string, { values }: Run): Promise<SentGraph> {
  const { seq } = await graphMoment(graph);
  const sent = readVersion(await publish(graph, seq));
  return values === undefined ? sent : { ...sent, values };
}

/** The graph that is started in the place of that of a run, with its values. */
async function sentGraph(runner: string, run: Run, which: RepeatedVersion): Promise<SentGraph> {
  if (which === "newest" && run.graph !== null) return newestOf(run.graph, run);
  const umrf = await fetchText(umrfUrl(runner, run.id));
  const inside = insideOf(run.subgraphs === undefined ? await getRun(runner, run.id) : run);
  if (!run.sent_digest) return { version: run.version ?? "", digest: run.digest, umrf, inside };
  const isWhole = !isOpened(run) && run.from === undefined;
  if (run.values && run.version && isWhole) {
    const text = await fetchText(`/api/versions/${encodeURIComponent(run.version)}`);
    return { ...readVersion(text), values: run.values };
  }
  // Without its version, and of a part or an opened graph, there is only what was sent: it has the values and asks
  // for nothing. What was opened has no graphs inside.
  const { subgraphs } = isOpened(run) ? {} : inside;
  const sent = { version: "", digest: run.sent_digest, umrf };
  return { ...sent, inside: { ...(subgraphs && { subgraphs }) } };
}

/** Return where a repeated run goes: its newest version is opened again, if the run had opened its own. */
function wayOf(run: Run, which: RepeatedVersion): Pick<StartOrder, "engines" | "led"> {
  if (which !== "newest" || !isOpened(run)) return { engines: [SIMULATOR] };
  const actors = Object.keys(run.robots ?? {});
  const robots = Object.fromEntries(actors.map((actor) => [actor, SIMULATOR]));
  return { engines: [CONDUCTED], led: { robots, lost: "stop", levels: "opened" } };
}

/** Starts it; whatever was not seen is chosen, and told. */
async function repeatRun(
  runner: string,
  run: Run,
  which: RepeatedVersion,
  fault?: Injected,
): Promise<Repeated> {
  const sent = await sentGraph(runner, run, which);
  const script =
    which === "newest"
      ? await recordedScriptFor(runner, run.id, sent.umrf, sent.inside?.subgraphs, fault)
      : await recordedScriptOf(runner, run.id, fault);
  const started = await startRun({
    runner,
    ...sent,
    graph: run.graph ?? "",
    ...wayOf(run, which),
    request: crypto.getRandomValues(new Uint32Array(4)).join("-"),
    script: { behaviours: script.behaviours },
  });
  return { run: started.runs[0]?.id ?? "", doubts: script.doubts };
}
