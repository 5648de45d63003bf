/** Lists what a robot runs: runs from here, and graphs that other programs started. */

import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconFileImport, IconSquareFilled } from "@tabler/icons-react";
import { Link } from "wouter";
import { errorText } from "../api/http";
import { enginesOf } from "../api/led-runs";
import { foreignGraphs, openRuns } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useCurrentName } from "../api/people";
import { heldGraph, type Robot, stopRobot } from "../api/robots";
import type { Run } from "../api/runs";
import { runStatus } from "../status/progress";
import { restLines } from "../status/rests";
import { StateLabel } from "../status/state-label";
import { isolated } from "../words/isolated";
import style from "./robot-runs.module.css";

interface Props {
  robot: Robot;
  onImport: (text: string, name: string) => void;
}

export function notifyRobotFailure(title: string, error: unknown): void {
  notifications.show({ color: "red", title, message: errorText(error) });
}

function Foreign(props: Props & { graph: string; stopping: string | null; state: string }) {
  const { robot, graph, stopping, state, onImport } = props;
  const { runner } = useLive();
  const take = () =>
    heldGraph(runner ?? "", robot.name, graph)
      .then((text) => onImport(text, graph))
      .catch((error: unknown) => notifyRobotFailure(`${isolated(graph)} was not imported`, error));
  const stop = () =>
    stopRobot(runner ?? "", robot.name).catch((error: unknown) =>
      notifyRobotFailure(`NOT SENT: use the hardware stop of ${isolated(robot.name)}`, error),
    );
  return (
    <li className={style.line}>
      <StateLabel tone="unknown" word={stopping === null ? state.toLowerCase() : "stopping"} />
      <span className="break-anywhere ink-inherit weight-550">{graph}</span>
      <span className="quiet-xs">
        {stopping ? `STOP UNCONFIRMED: ${stopping}` : "not started from here"}
      </span>
      <span className="flex-1" />
      <Button
        size="compact-sm"
        leftSection={<IconFileImport size={15} aria-hidden />}
        onClick={() => void take()}
      >
        Import as graph
      </Button>
      <Button
        size="compact-sm"
        variant="filled"
        color="red"
        leftSection={<IconSquareFilled size={11} aria-hidden />}
        onClick={() => void stop()}
      >
        Stop
      </Button>
    </li>
  );
}

function StartedBy({ run }: { run: Run }) {
  return <span className="quiet-xs">started by {isolated(useCurrentName(run.author))}</span>;
}

/** A led run that carries this robot: it may begin further actions here as long as it goes on. */
function LedRun({ run, robot }: { run: Run; robot: string }) {
  const { live, now } = useLive(run.id);
  const rest = restLines(run, now.link === "down").find((each) => each.robot === robot);
  const further =
    run.desired === "stopped"
      ? "it is being stopped, no further action begins here"
      : run.hidden
        ? "more of it may begin here until it ends"
        : run.held
          ? "further actions begin here once a person lets it go on"
          : "further actions begin here until it ends";
  return (
    <li className={style.line}>
      {rest && <StateLabel still tone={rest.tone} word={rest.words} />}
      <span>
        In{" "}
        <Link to={`/runs/${run.id}`} className="break-anywhere ink-inherit weight-550">
          <bdi>{run.graph_name}</bdi>’s run {run.number} (led)
        </Link>
        : {further}.
      </span>
      <StartedBy run={run} />
      <span className="flex-1" />
      <Button
        size="compact-sm"
        variant="filled"
        color="red"
        leftSection={<IconSquareFilled size={11} aria-hidden />}
        aria-label={`Stop run ${run.number} on all of its robots`}
        onClick={() => live?.stop(run.id)}
      >
        Stop
      </Button>
    </li>
  );
}

export function RobotRuns({ robot, onImport }: Props) {
  const { now } = useLive();
  const own = openRuns(now).filter((run) => enginesOf(run).includes(robot.name));
  const foreign = foreignGraphs(now).filter((each) => each.robot.name === robot.name);
  const unsure = robot.state !== "answering" && robot.state !== "restarted";
  if (own.length + foreign.length === 0) {
    return (
      <p className={style.none}>
        {unsure ? "What runs there is not known." : "Nothing runs there."}
      </p>
    );
  }
  return (
    <ul className={style.list} aria-label={`What runs on ${isolated(robot.name)}`}>
      {own.map((run) =>
        run.robots ? (
          <LedRun key={run.id} run={run} robot={robot.name} />
        ) : (
          <li key={run.id} className={style.line}>
            <StateLabel {...runStatus(run, now)} />
            <Link to={`/runs/${run.id}`} className="break-anywhere ink-inherit weight-550">
              Run {run.number} of <bdi>{run.graph_name}</bdi>
            </Link>
            <StartedBy run={run} />
          </li>
        ),
      )}
      {foreign.map(({ held }) => (
        <Foreign
          key={held.graph}
          robot={robot}
          graph={held.graph}
          state={unsure ? "unknown" : held.state}
          stopping={held.stopping}
          onImport={onImport}
        />
      ))}
    </ul>
  );
}
