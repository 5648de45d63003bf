/** State of one of the two processes, and the resources that it uses. */

import type { ReactNode } from "react";
import { errorText } from "../api/http";
import { serverNow } from "../clock/server-clock";
import { ago, instant } from "../ui/times";
import style from "./administration.module.css";
import { bytes, type ProcessStatus, span, type useStatus } from "./status";

/** Bytes of the disk below which somebody should make room. */
const TIGHT = 1_000_000_000;

const PARTS: Readonly<Record<string, string>> = {
  database: "Database",
  writer: "Writer",
  schema: "Tables",
  disk: "Disk",
  recording: "Recording of runs",
  rclpy: "Way to robots",
};

function loadFacts({ load, at, began_at }: ProcessStatus): StatusFact[] {
  const files = load.open_files === null ? "not known" : `${load.open_files}`;
  const lag = Math.round(1000 * load.loop_lag_s);
  return [
    { name: "Up for", value: span(Date.parse(at) - Date.parse(began_at)) },
    { name: "Memory", value: load.memory === null ? "not known" : bytes(load.memory) },
    { name: "Processor time", value: span(1000 * load.cpu_s) },
    { name: "Loop lag", value: `at most ${lag} ms in the last minute`, isBad: lag > 500 },
    { name: "Open files", value: `${files} of ${load.most_files}` },
  ];
}

function storageFacts({ storage, journal }: ProcessStatus): StatusFact[] {
  const { failing, waiting, busy_s } = journal;
  const stored = failing ?? (waiting === 0 ? "nothing waits" : `${waiting} wait`);
  const facts: StatusFact[] = [
    { name: "Database", value: <bdi>{journal.database.replace(/^The database /, "")}</bdi> },
    { name: "Journal", value: stored, isBad: failing !== null || busy_s > 2 },
  ];
  if (storage === null) return [...facts, { name: "Disk", value: "not looked at yet" }];
  const { database, wal, free, size, folders } = storage;
  if (database !== null) facts.push({ name: "Database size", value: bytes(database) });
  if (wal !== null) facts.push({ name: "Write-ahead log", value: bytes(wal) });
  for (const [name, count] of Object.entries(folders)) {
    facts.push({ name: `Folder ${name}`, value: bytes(count) });
  }
  const left = `${bytes(free)} of ${bytes(size)} free`;
  return [...facts, { name: "Disk", value: left, isBad: free < TIGHT }];
}

function activityFacts({ activity, workers }: ProcessStatus): StatusFact[] {
  const { sockets, rooms, runs, stops_unconfirmed } = activity;
  const facts: StatusFact[] = [{ name: "Open sockets", value: sockets }];
  if (rooms != null) facts.push({ name: "Open graphs", value: rooms });
  if (runs != null) facts.push({ name: "Open runs", value: runs });
  if (stops_unconfirmed != null) {
    const isBad = stops_unconfirmed > 0;
    facts.push({ name: "Stops unconfirmed", value: stops_unconfirmed, isBad });
  }
  const busy = workers.reduce((all, lane) => all + lane.busy, 0);
  const waiting = workers.reduce((all, lane) => all + lane.waiting, 0);
  const deaths = workers.reduce((all, lane) => all + lane.deaths, 0);
  facts.push({ name: "Workers", value: `${busy} busy, ${waiting} requests` });
  if (deaths > 0) facts.push({ name: "Workers that died", value: deaths, isBad: true });
  return facts;
}

function Lacking({ status }: { status: ProcessStatus }) {
  const parts = Object.entries(status.readiness.parts ?? {});
  const lacking = parts.filter(([, why]) => why !== null);
  if (lacking.length === 0) return null;
  return (
    <ul className={style.lacking}>
      {lacking.map(([part, why]) => (
        <li key={part}>
          <b>{PARTS[part] ?? part}</b>: {why}
        </li>
      ))}
    </ul>
  );
}

const WORDS = {
  ready: "Ready",
  lacking: "Not ready",
  silent: "No answer",
  unknown: "Not known yet",
} as const;

function readinessOf({ readiness }: ProcessStatus): "ready" | "lacking" {
  return readiness.ready ? "ready" : "lacking";
}

interface Props {
  title: string;
  asked: ReturnType<typeof useStatus>;
}

export function ProcessCard({ title, asked: { data, error } }: Props) {
  const state = error ? "silent" : data === undefined ? "unknown" : readinessOf(data);
  return (
    <section className="page-card min-w-0" aria-label={title}>
      <div className={style.cardHead}>
        <h3>{title}</h3>
        <span className={style.state} data-state={state}>
          {WORDS[state]}
        </span>
        {data && (
          <span className="m-0 ink2 text-13">
            Version {data.versions.program}, tables {data.versions.schema}, Python{" "}
            {data.versions.python}
          </span>
        )}
      </div>
      {error && (
        <p className={style.refused} role="alert">
          {errorText(error)}
          {data && ` The figures below are from ${ago(instant(data.at) ?? 0, serverNow())}.`}
        </p>
      )}
      {data && <Lacking status={data} />}
      {data && (
        <Facts facts={[...loadFacts(data), ...activityFacts(data), ...storageFacts(data)]} />
      )}
    </section>
  );
}

export interface StatusFact {
  readonly name: string;
  readonly value: ReactNode;
  /** True if a person should look at this fact. */
  readonly isBad?: boolean;
}

export function Facts({ facts }: { facts: readonly StatusFact[] }) {
  return (
    <dl className={style.facts}>
      {facts.map(({ name, value, isBad }) => (
        <div key={name} data-bad={isBad || undefined}>
          <dt>{name}</dt>
          <dd className="m-0 fill break-anywhere">{value}</dd>
        </div>
      ))}
    </dl>
  );
}
