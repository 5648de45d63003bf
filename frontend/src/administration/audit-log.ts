/** The audit of both processes: its filters, its order over both logs, and its files. */
import { useInfiniteQuery } from "@tanstack/react-query";
import { editor, runnerAt } from "../api/client";
import { errorText } from "../api/http";
import type { EditorApi } from "../api/schema/editor";

export type AuditRow = EditorApi["AuditRow"];
export type AuditPage = EditorApi["AuditPage"];
type AuditKind = AuditRow["kind"];

/** The kinds of rows, in the order of the filter, and their names. */
export const AUDIT_KINDS: readonly { readonly value: AuditKind; readonly label: string }[] = [
  { value: "edits", label: "Edits" },
  { value: "graphs", label: "Graphs and versions" },
  { value: "starts", label: "Starts and runs" },
  { value: "refused", label: "Refused starts" },
  { value: "stops", label: "Stops" },
  { value: "robots", label: "Robots" },
  { value: "sessions", label: "Sign-ins" },
  { value: "people", label: "People, links, tokens" },
  { value: "strangers", label: "Strangers" },
  { value: "other", label: "Other" },
];

/** Filter of the audit; empty fields match all. `since` and `until` are days, `2026-11-28`. */
export interface AuditFilter {
  readonly text: string;
  readonly person: string;
  readonly robot: string;
  readonly graph: string;
  readonly kind: string;
  readonly since: string;
  readonly until: string;
}

const FIELDS = ["text", "person", "robot", "graph", "kind", "since", "until"] as const;

/** Return the filter in the address of the page. */
export function auditFilterOf(query: URLSearchParams): AuditFilter {
  const part = (name: (typeof FIELDS)[number]) => query.get(name) ?? "";
  return {
    text: part("text"),
    person: part("person"),
    robot: part("robot"),
    graph: part("graph"),
    kind: part("kind"),
    since: part("since"),
    until: part("until"),
  };
}

/** Return the filter as a query for the address of the page; empty fields are left out. */
export function auditQueryOf(filter: AuditFilter): URLSearchParams {
  return new URLSearchParams(FIELDS.filter((f) => filter[f] !== "").map((f) => [f, filter[f]]));
}

/** Return the begin of a day here, or of the next one, as an instant. Undefined for no day. */
function dayBegin(day: string, add: 0 | 1): string | undefined {
  const [year = 0, month = 0, date = 0] = day.split("-").map(Number);
  const begin = new Date(year, month - 1, date + add);
  return day === "" || Number.isNaN(begin.getTime()) ? undefined : begin.toISOString();
}

function asked(filter: AuditFilter, limit: number, before: number | null) {
  const { text, person, robot, graph, kind } = filter;
  const given = { text, person, robot, graph, kind, limit: String(limit) };
  const query = new URLSearchParams(Object.entries(given).filter(([, value]) => value !== ""));
  const since = dayBegin(filter.since, 0);
  const until = dayBegin(filter.until, 1);
  if (since !== undefined) query.set("since", since);
  if (until !== undefined) query.set("until", until);
  if (before !== null) query.set("before", String(before));
  return query;
}

export type LogName = "editor" | "runner";

/** Fetch one page of the log of a process. The runner answers at `runner`. */
function fetchPage(
  name: LogName,
  runner: string | undefined,
  query: URLSearchParams,
  timeoutMs: number,
  signal?: AbortSignal,
): Promise<AuditPage> {
  const request = { query, signal, timeoutMs };
  if (name === "editor") return editor.get("/api/audit", request);
  return runnerAt(runner).get("/api/audit", request) as Promise<AuditPage>;
}

export type DroppedRows = NonNullable<AuditPage["dropped"]>;

/** The part of the log of one process that is known. `backTo`: the instant to which it was read, 0 if to its
 * begin; `problem`: why it cannot be read; `dropped`: old rows that it has dropped, null for none. */
export interface ReadLog {
  readonly rows: readonly AuditRow[];
  readonly backTo: number;
  readonly problem: string | null;
  readonly dropped: DroppedRows | null;
}

/** Return a sentence about the rows that a process has dropped. */
export function droppedText(log: LogName, { until, at, days }: DroppedRows): string {
  const day = (time: string) => time.slice(0, 10);
  return (
    `The ${log} keeps for ${days} days what only the audit has, such as sign-ins and refusals: ` +
    `such rows up to ${day(until)} were dropped on ${day(at)}.`
  );
}

/** Rows of all logs, newest first. A row waits until the other logs were read as far back. */
export function mergedRows(logs: readonly Omit<ReadLog, "dropped">[]): readonly AuditRow[] {
  const read = Math.max(0, ...logs.filter((log) => log.problem === null).map((log) => log.backTo));
  return logs
    .flatMap((log) => log.rows)
    .filter((row) => Date.parse(row.at) >= read)
    .sort((a, b) => Date.parse(b.at) - Date.parse(a.at) || b.position - a.position);
}

const PAGE = 100;
const PAGE_MS = 10_000; // after which the part of a process is said to be missing
const FILE_MS = 60_000;

export function useAuditLog(name: LogName, runner: string | undefined, filter: AuditFilter) {
  const query = useInfiniteQuery({
    queryKey: ["audit", name, runner, filter],
    queryFn: ({ pageParam, signal }) =>
      fetchPage(name, runner, asked(filter, PAGE, pageParam), PAGE_MS, signal),
    initialPageParam: null as number | null,
    getNextPageParam: (page) => page.before,
    enabled: name === "editor" || runner !== undefined,
    retry: false,
    refetchOnWindowFocus: false,
  });
  const pages = query.data?.pages ?? [];
  const last = pages.at(-1);
  const backTo = last === undefined ? Number.POSITIVE_INFINITY : Date.parse(last.back_to ?? "");
  const log: ReadLog = {
    rows: pages.flatMap((page) => page.rows),
    backTo: last?.before === null || Number.isNaN(backTo) ? 0 : backTo,
    problem: query.error === null ? null : errorText(query.error),
    dropped: pages[0]?.dropped ?? null, // a process of an earlier version says nothing of it
  };
  return { log, query };
}

/** Most rows of one file: a spreadsheet takes about a million, a browser's memory fewer. */
const MOST_ROWS = 100_000;

export interface AuditFile {
  readonly rows: readonly AuditRow[];
  /** Sentences about what the file lacks. */
  readonly lacks: readonly string[];
}

/** Fetch all rows of a filter from both logs. `onRows` gets the number of rows so far. */
export async function fetchEverything(
  filter: AuditFilter,
  runner: string | undefined,
  onRows: (count: number) => void,
): Promise<AuditFile> {
  const logs: AuditRow[][] = [];
  const lacks: string[] = [];
  for (const log of ["editor", "runner"] as const) {
    const rows: AuditRow[] = [];
    try {
      let before: number | null = null;
      do {
        const page: AuditPage = await fetchPage(log, runner, asked(filter, 1000, before), FILE_MS);
        if (before === null && page.dropped) lacks.push(droppedText(log, page.dropped));
        rows.push(...page.rows);
        before = page.before;
        onRows(logs.flat().length + rows.length);
      } while (before !== null && rows.length < MOST_ROWS);
      if (before !== null) lacks.push(`Only the newest ${MOST_ROWS} rows of the ${log} are in it.`);
    } catch (error) {
      lacks.push(`The part of the ${log} is missing: ${errorText(error)}`);
    }
    logs.push(rows);
  }
  return { rows: mergedRows(logs.map((rows) => ({ rows, backTo: 0, problem: null }))), lacks };
}

const COLUMNS = [
  ...["time", "id", "kind", "event", "person", "person_id", "text", "graph", "graph_name", "seq"],
  ...["run", "run_number", "robots", "address", "session", "token"],
];

function cellsOf(row: AuditRow): readonly (string | number | null | undefined)[] {
  const { from } = row;
  return [
    ...[row.at, row.id, row.kind, row.event, row.person?.name, row.person?.id, row.text],
    ...[row.graph, row.graph_name, row.seq, row.run, row.run_number, row.robots?.join(", ")],
    ...[from?.address, from?.session, from?.token],
  ];
}

/** A cell that no spreadsheet takes for a formula. */
function cell(value: string | number | null | undefined): string {
  const text = value === null || value === undefined ? "" : String(value);
  const safe = /^[=+\-@\t\r\n]/.test(text) ? `'${text}` : text;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

export function csvOf(rows: readonly AuditRow[]): string {
  return [COLUMNS, ...rows.map(cellsOf)].map((line) => `${line.map(cell).join(",")}\r\n`).join("");
}
