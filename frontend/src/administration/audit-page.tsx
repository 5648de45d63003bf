/** The audit, for owners: who did what, when and from where, over the logs of both processes. */
import { Button, MultiSelect, Select, TextInput } from "@mantine/core";
import { useDebouncedCallback } from "@mantine/hooks";
import { notifications } from "@mantine/notifications";
import { IconDownload, IconFileSearch, IconSearch } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { useGraphNames } from "../api/graph-names";
import { useLive } from "../api/page-link";
import { currentName, useKnownPeople, useMay, usePerson } from "../api/people";
import { useSiteChoice } from "../status/site-choice";
import { Empty } from "../ui/empty";
import { clock, day, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import {
  AUDIT_KINDS,
  type AuditFilter,
  type AuditRow,
  auditFilterOf,
  auditQueryOf,
  csvOf,
  droppedText,
  fetchEverything,
  type LogName,
  mergedRows,
  useAuditLog,
} from "./audit-log";
import style from "./audit-page.module.css";

const NO_PEOPLE: readonly string[] = [];

export function AuditPage() {
  const may = useMay("share");
  return (
    <main className="page">
      <div className={style.inner}>
        <h2 className="page-title">Audit</h2>
        {may ? (
          <Inside />
        ) : (
          <Empty icon={<IconFileSearch size={22} />} title="For owners only">
            Only an owner sees here who did what, when and from where.
          </Empty>
        )}
      </div>
    </main>
  );
}

function Inside() {
  const [, go] = useLocation();
  const filter = auditFilterOf(new URLSearchParams(useSearch()));
  const { runner, choice } = useSiteChoice();
  const logs = {
    editor: useAuditLog("editor", undefined, filter),
    runner: useAuditLog("runner", runner, filter),
  };
  const both = [logs.editor, logs.runner];
  const rows = mergedRows(both.map(({ log }) => log));
  const now = useNow(60_000);
  const { person: me } = usePerson();
  const known = useKnownPeople(NO_PEOPLE);
  const nameOf = ({ person }: AuditRow) => (person ? currentName(person, me, known) : "");
  const waits = both.some(({ query }) => query.isFetching);
  const older = both.filter(({ query }) => query.hasNextPage);
  const lookBack = () => {
    const furthest = Math.max(...older.map(({ log }) => log.backTo));
    for (const { log, query } of older) {
      if (log.backTo === furthest) void query.fetchNextPage();
    }
  };
  useEffect(() => {
    if (rows.length === 0 && !waits && older.length > 0) lookBack();
  });
  return (
    <>
      <Filters
        filter={filter}
        onChange={(next) => go(`/audit?${auditQueryOf(next)}`, { replace: true })}
      />
      {choice}
      <Download filter={filter} runner={runner} />
      <Away log="editor" problem={logs.editor.log.problem} />
      <Away log="runner" problem={logs.runner.log.problem} />
      {(["editor", "runner"] as const).map((name) => {
        const { dropped } = logs[name].log;
        return dropped === null ? null : (
          <p key={name} className="m-0 quiet-12" role="status">
            {droppedText(name, dropped)}
          </p>
        );
      })}
      <section className="page-card min-w-0" aria-label="Audit" aria-busy={waits}>
        {rows.length === 0 && !waits && older.length === 0 ? (
          <Empty icon={<IconFileSearch size={22} />} title="Nothing is found">
            No event of the logs matches these filters.
          </Empty>
        ) : (
          <ol className="m-0 p-0 text-13 list-none">
            {rows.map((row) => (
              <Row key={row.id} row={row} who={nameOf(row)} now={now} />
            ))}
          </ol>
        )}
        <Older waits={waits} backTo={older.map(({ log }) => log.backTo)} onLook={lookBack} />
      </section>
      <p className="m-0 quiet-12">
        What happened to graphs, runs, robots and people is kept as long as the logs are; sign-ins,
        refusals and the like as long as the administrator has set, by whole months.{" "}
        <code>action-assistant audit verify</code> proves both chains and prints the line to keep
        elsewhere.
      </p>
    </>
  );
}

function Older(props: { waits: boolean; backTo: readonly number[]; onLook: () => void }) {
  const now = useNow(60_000);
  if (props.backTo.length === 0) {
    return props.waits ? <p className="m-0 quiet-12">Looking …</p> : null;
  }
  const furthest = Math.max(...props.backTo);
  return (
    <div className="row-wrap gap-50 p-50-75">
      <Button variant="default" loading={props.waits} onClick={props.onLook}>
        Older
      </Button>
      {Number.isFinite(furthest) && (
        <span className="quiet-12">
          Read back to {day(furthest, now)} {clock(furthest)}
        </span>
      )}
    </div>
  );
}

function Away({ log, problem }: { log: LogName; problem: string | null }) {
  if (problem === null) return null;
  return (
    <p className={style.away} role="status">
      The part of the {log} is missing here: {problem}
    </p>
  );
}

interface RowProps {
  row: AuditRow;
  who: string;
  now: number;
}

function Row({ row, who, now }: RowProps) {
  const at = instant(row.at) ?? 0;
  const graph = row.graph && `/graphs/${encodeURIComponent(row.graph)}`;
  return (
    <li className={style.row} data-kind={row.kind}>
      <time className={style.time} dateTime={row.at} title={row.at}>
        {day(at, now)} {clock(at)}
      </time>
      <span className={style.what}>
        {who && (
          <>
            <bdi className="weight-600">{who}</bdi>{" "}
          </>
        )}
        <bdi>{row.text}</bdi>
      </span>
      <span className={style.links}>
        {row.run && <Link to={`/runs/${encodeURIComponent(row.run)}`}>Run {row.run_number}</Link>}
        {graph && (
          <Link to={row.seq ? `${graph}?at=${row.seq}` : graph}>
            {row.seq ? `Graph at ${row.seq}` : "Graph"}
          </Link>
        )}
      </span>
      <span className={style.from}>{whence(row)}</span>
    </li>
  );
}

/** Return the connection of a person in words. */
function whence({ from, person }: AuditRow): string {
  if (!from) return person ? "connection not recorded" : "";
  const where = from.address ? from.address : "this computer";
  if (from.token) return `${where}, token ${from.token}`;
  return from.session ? `${where}, session ${from.session.slice(0, 6)}` : where;
}

interface FiltersProps {
  filter: AuditFilter;
  onChange: (filter: AuditFilter) => void;
}

function Filters({ filter, onChange }: FiltersProps) {
  const [text, setText] = useState(filter.text);
  useEffect(() => setText(filter.text), [filter.text]);
  const search = useDebouncedCallback((next: string) => onChange({ ...filter, text: next }), 300);
  const people = useKnownPeople(NO_PEOPLE).filter(({ name }) => name !== "");
  const { data: graphs = [] } = useGraphNames();
  const { engines } = useLive().now;
  return (
    <search className={style.filters} aria-label="Filter the audit">
      <TextInput
        label="Words"
        placeholder="Name, address"
        leftSection={<IconSearch size={15} aria-hidden />}
        value={text}
        onChange={(event) => {
          setText(event.currentTarget.value);
          search(event.currentTarget.value.trim());
        }}
      />
      <Choice
        label="Person"
        data={people.map(({ id, name }) => ({ value: id, label: isolated(name) }))}
        value={filter.person}
        onChange={(person) => onChange({ ...filter, person })}
      />
      <MultiSelect
        label="Kinds"
        placeholder={filter.kind === "" ? "All" : ""}
        data={AUDIT_KINDS.map((each) => ({ ...each }))}
        value={filter.kind === "" ? [] : filter.kind.split(",")}
        clearable
        onChange={(kinds) => onChange({ ...filter, kind: kinds.join(",") })}
      />
      <Choice
        label="Robot"
        data={engines.map(({ name }) => ({ value: name, label: isolated(name) }))}
        value={filter.robot}
        onChange={(robot) => onChange({ ...filter, robot })}
      />
      <Choice
        label="Graph"
        data={graphs.map(({ id, name }) => ({ value: id, label: isolated(name) || id }))}
        value={filter.graph}
        onChange={(graph) => onChange({ ...filter, graph })}
      />
      <TextInput
        label="From day"
        type="date"
        value={filter.since}
        onChange={(event) => onChange({ ...filter, since: event.currentTarget.value })}
      />
      <TextInput
        label="To day"
        type="date"
        value={filter.until}
        onChange={(event) => onChange({ ...filter, until: event.currentTarget.value })}
      />
    </search>
  );
}

interface ChoiceProps {
  label: string;
  data: { value: string; label: string }[];
  value: string;
  onChange: (value: string) => void;
}

/** A choice that also shows a value of the address which is not among the known ones. */
function Choice({ label, data, value, onChange }: ChoiceProps) {
  const isKnown = value === "" || data.some((each) => each.value === value);
  return (
    <Select
      label={label}
      placeholder="Any"
      data={isKnown ? data : [...data, { value, label: value }]}
      value={value || null}
      clearable
      searchable
      onChange={(next) => onChange(next ?? "")}
    />
  );
}

function Download({ filter, runner }: { filter: AuditFilter; runner: string | undefined }) {
  const [count, setCount] = useState<number | null>(null);
  const save = async (form: "csv" | "json") => {
    setCount(0);
    try {
      const { rows, lacks } = await fetchEverything(filter, runner, setCount);
      const text = form === "csv" ? csvOf(rows) : `${JSON.stringify({ rows, lacks }, null, 1)}\n`;
      const type = form === "csv" ? "text/csv;charset=utf-8" : "application/json";
      saveText(text, type, `audit.${form}`);
      for (const message of lacks) {
        notifications.show({ color: "red", title: "The file is not complete", message });
      }
    } finally {
      setCount(null);
    }
  };
  return (
    <div className="row-wrap gap-50">
      {(["csv", "json"] as const).map((form) => (
        <Button
          key={form}
          size="xs"
          variant="default"
          leftSection={<IconDownload size={15} aria-hidden />}
          disabled={count !== null}
          onClick={() => void save(form)}
        >
          {form.toUpperCase()}
        </Button>
      ))}
      {count !== null && (
        <span className="quiet-12" role="status">
          {count} rows read …
        </span>
      )}
    </div>
  );
}

function saveText(text: string, type: string, name: string): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
