/** The log of a robot: what others told it and how its engine was, newest first. */

import { Button, Text } from "@mantine/core";
import { IconFileImport } from "@tabler/icons-react";
import { Link } from "wouter";
import { useLive } from "../api/page-link";
import { commandedGraph, type RobotLogLine, useRobotLog } from "../api/robots";
import { serverNow } from "../clock/server-clock";
import { clock, day, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./robot-log.module.css";
import { notifyRobotFailure } from "./robot-runs";

interface Props {
  robot: string;
  onImport: (text: string, name: string) => void;
}

const DONE: Readonly<Record<string, string>> = {
  start: "started",
  stop: "stopped",
  pause: "paused",
  resume: "let go on",
  modify: "changed",
};

const BECAME: Readonly<Record<string, string>> = {
  answering: "The engine answers",
  busy: "The engine is there, but silent",
  gone: "The engine is gone",
  restarted: "The engine was restarted",
};

/** Return words about the files that were written for a robot, or about the reason why not. */
function writtenText({ sender, files, why }: RobotLogLine): string {
  const each = files.map(
    ({ graph, path, kept }) => `${isolated(graph)} (${path}${kept ? `; before: ${kept}` : ""})`,
  );
  const done =
    files.length > 0
      ? `${isolated(sender)} wrote ${each.join(", ")}`
      : `${isolated(sender)} wrote nothing`;
  return why === "" ? done : `${done}: ${why}`;
}

/** Return a sentence about a baton that has passed. */
function batonText({ how, sender, was, to, why }: RobotLogLine): string {
  switch (how) {
    case "handed":
      return `${isolated(was)} handed the baton to ${isolated(to)}`;
    case "forced":
      return `${isolated(to)} took the baton over from ${isolated(was)}: ${why}`;
    case "dropped":
      return `${isolated(was)} dropped the baton`;
    case "fell":
      return `The baton of ${isolated(was)} fell: ${why}`;
    case "off":
      return `${isolated(sender)} switched the baton off, which ${isolated(was)} held`;
    default:
      return `${isolated(to)} took the baton`;
  }
}

/** A sentence of one line; what it did to a run of ours comes after it. */
function robotLogText(told: RobotLogLine): string {
  switch (told.kind) {
    case "commanded":
      return `Somebody else ${DONE[told.command] ?? told.command} ${isolated(told.graph || "a graph")}`;
    case "became":
      return `${BECAME[told.state] ?? told.state}${told.why === "" ? "" : `: ${told.why}`}`;
    case "stop_asked":
      return `${isolated(told.sender)} asked to stop ${isolated(told.graph)}, which was not started from here`;
    case "stop_proven":
      return `${isolated(told.graph)} is proven to have stopped`;
    case "stop_unproven":
      return `Nothing has proven that ${isolated(told.graph)} stopped: ${told.why}`;
    case "index_write_asked":
      return `${isolated(told.sender)} asked to write ${told.graphs.map(isolated).join(", ")} into its index folder`;
    case "index_written":
      return writtenText(told);
    case "baton":
      return batonText(told);
    case "rights_set":
      return `${isolated(told.sender)} set who may start there`;
    case "locked":
      return `${isolated(told.sender)} put it out of service: ${told.why}`;
    case "unlocked":
      return `${isolated(told.sender)} took the lock of ${isolated(told.was)} off`;
    case "drilled":
      return `${isolated(told.sender)} made a Stop drill with run ${told.number}: ${told.why === "" ? "it passed" : `it failed: ${told.why}`}`;
  }
}

/** Shows the effect of a foreign command on a run from here. */
function Effect({ told }: { told: RobotLogLine }) {
  if (told.run === null || told.kind === "drilled") return null;
  const stopped = told.command === "start" || told.command === "stop";
  return (
    <Link to={`/runs/${told.run}`} className="ink-error weight-600">
      {stopped ? "stopped" : "while"} run {told.number}
    </Link>
  );
}

function Line({ robot, told, onImport }: Props & { told: RobotLogLine }) {
  const { runner } = useLive();
  const at = instant(told.at) ?? 0;
  const take = () =>
    commandedGraph(runner ?? "", robot, told.seq)
      .then((text) => onImport(text, told.graph))
      .catch((error: unknown) => notifyRobotFailure("Not imported", error));
  return (
    <li className={style.line} data-kind={told.kind}>
      <time dateTime={told.at}>
        {day(at, serverNow())} {clock(at)}
      </time>
      <span className={style.words}>
        {robotLogText(told)} <Effect told={told} />
      </span>
      {told.has_graph && (
        <Button
          size="compact-xs"
          variant="subtle"
          leftSection={<IconFileImport size={14} aria-hidden />}
          onClick={() => void take()}
        >
          Import
        </Button>
      )}
    </li>
  );
}

export function RobotLog({ robot, onImport }: Props) {
  const { runner } = useLive();
  const entries = useRobotLog(runner, robot, true);
  if (entries.isPending) return <Text c="dimmed">Reading …</Text>;
  if (entries.isError) return <Text c="var(--error)">The record cannot be read now.</Text>;
  if (entries.data.length === 0) {
    return <Text c="dimmed">No command of others was seen while the runner was listening.</Text>;
  }
  return (
    <ol className="list-reset">
      {entries.data.map((told) => (
        <Line key={told.seq} robot={robot} told={told} onImport={onImport} />
      ))}
    </ol>
  );
}
