/** Values as they were sent beside those that the engine reported, visit by visit, and those that it gave. */
import type { ActionRun, Run } from "../api/runs";
import { placesOf, wayWords } from "../status/level-places";
import { counted } from "../words/counted";
import style from "./run-parameters.module.css";

interface Props {
  run: Run;
  /** The action that is chosen, as the run calls it. */
  selected: string | null;
  onPick: (fact: string | null) => void;
}

function Value({ text, differs }: { text: string | null; differs: boolean }) {
  if (text === null) return <td className={style.none}>—</td>;
  return (
    <td data-differs={differs || undefined}>
      {differs && <abbr title="Not the value that was sent: it was changed on the way">≠ </abbr>}
      <code title={text}>{text}</code>
    </td>
  );
}

/** A number over the visits of an action, as a chart of the height of a line. */
function ValueChart({ over }: { over: readonly number[] }) {
  const [low, high] = [Math.min(...over), Math.max(...over)];
  const at = (value: number) => (high === low ? 9 : 17 - ((value - low) / (high - low)) * 16);
  const points = over.map((value, i) => `${1 + (i / (over.length - 1)) * 78},${at(value)}`);
  const words = `${over.length} visits: from ${low} to ${high}, last ${over.at(-1)}`;
  return (
    <svg className={style.chart} viewBox="0 0 80 18" role="img" aria-label={words}>
      <title>{words}</title>
      <polyline points={points.join(" ")} />
    </svg>
  );
}

function Rows({ rows, charts }: { rows: readonly ParameterRow[]; charts: boolean }) {
  return (
    <tbody>
      {rows.map((row) => (
        <tr key={row.parameter}>
          <th scope="row">{row.parameter.replaceAll("::", " / ")}</th>
          {charts && <td>{row.over && <ValueChart over={row.over} />}</td>}
          {row.sent !== undefined && <Value text={row.sent} differs={false} />}
          {row.ran.map((text, i) => (
            // biome-ignore lint/suspicious/noArrayIndexKey: visits only ever grow
            <Value key={i} text={text} differs={row.sent !== undefined && text !== row.sent} />
          ))}
        </tr>
      ))}
    </tbody>
  );
}

/** A table of values: a row for each parameter, a column for each group of visits. */
function Table({
  title,
  of,
  columns,
  rows,
}: {
  title: string;
  /** The action in words. */
  of: string;
  columns: readonly string[];
  rows: readonly ParameterRow[];
}) {
  const charts = rows.some((row) => row.over);
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: what is wider than its place is scrolled by keys, too
    <section className={style.scroll} tabIndex={0} aria-label={`${title}: ${of}`}>
      <table>
        <thead>
          <tr>
            <th>{title}</th>
            {charts && <th>Over visits</th>}
            {columns.map((words) => (
              <th key={words}>{words}</th>
            ))}
          </tr>
        </thead>
        <Rows rows={rows} charts={charts} />
      </table>
    </section>
  );
}

function Action(props: { name: string; action: ActionRun; run: Run; onPick: () => void }) {
  const { name, action, run, onPick } = props;
  const words = wayWords(placesOf(run).get(name) ?? { levels: [], name });
  const found = parametersOfVisits(run.sent?.[name] ?? {}, action);
  const gave = outputsOfVisits(action);
  return (
    <section className={style.action} aria-label={`Parameters of ${words}`}>
      <h2>
        <button type="button" onClick={onPick}>
          <bdi>{words}</bdi>
        </button>
      </h2>
      {found.rows.length === 0 ? (
        <p className={style.none}>No parameter has a value.</p>
      ) : (
        <Table title="Parameter" of={words} columns={["Sent", ...found.visits]} rows={found.rows} />
      )}
      {gave.rows.length > 0 && (
        <Table title="Output, as observed" of={words} columns={gave.visits} rows={gave.rows} />
      )}
      {found.unseen > 0 && (
        <p className={style.none}>Of {counted(found.unseen, "visit")} nobody saw the values.</p>
      )}
    </section>
  );
}

export function RunParameters({ run, selected, onPick }: Props) {
  const all = Object.entries(run.actions ?? {});
  const chosen = all.filter(([name]) => selected === null || name === selected);
  const told = chosen.filter(
    ([name, action]) =>
      selected !== null ||
      run.sent?.[name] !== undefined ||
      action.visits.some((visit) => Object.keys({ ...visit.inputs, ...visit.outputs }).length > 0),
  );
  return (
    <div className={style.parameters}>
      {selected !== null && (
        <button type="button" className={style.all} onClick={() => onPick(null)}>
          Show all actions
        </button>
      )}
      {told.length === 0 && <p className={style.none}>No action was given a value.</p>}
      {told.map(([name, action]) => (
        <Action key={name} name={name} action={action} run={run} onPick={() => onPick(name)} />
      ))}
    </div>
  );
}

interface ParameterRow {
  parameter: string;
  /** JSON text; null where it had no value, and left out for an output, which is never sent. */
  sent?: string | null;
  /** One for each group of visits. */
  ran: readonly (string | null)[];
  /** Its numbers, visit by visit, where there are enough of them and they differ. */
  over?: readonly number[];
}

export interface ParametersOfVisits {
  rows: readonly ParameterRow[];
  /** The groups of visits in words: neighbours that ran with the same are one. */
  visits: readonly string[];
  /** Visits whose values nobody saw. */
  unseen: number;
}

type ReportedValues = Readonly<Record<string, string>>;

interface VisitGroup {
  first: number;
  last: number;
  values: ReportedValues;
}

function alike(a: ReportedValues, b: ReportedValues): boolean {
  const names = Object.keys(a);
  return names.length === Object.keys(b).length && names.every((name) => a[name] === b[name]);
}

function groupsOf(action: ActionRun, side: "inputs" | "outputs"): VisitGroup[] {
  const groups: VisitGroup[] = [];
  action.visits.forEach((visit, i) => {
    const values = visit[side];
    if (values == null) return;
    const number = action.older + i + 1;
    const before = groups.at(-1);
    if (before?.last === number - 1 && alike(before.values, values)) before.last = number;
    else groups.push({ first: number, last: number, values });
  });
  return groups;
}

function wordsOf(group: VisitGroup, only: string | null): string {
  if (only !== null) return only;
  return group.first === group.last
    ? `Visit ${group.first}`
    : `Visits ${group.first}–${group.last}`;
}

const FEWEST = 3; // visits in a chart

/** Return the numbers of a parameter over the visits that reported one; nothing where a chart says no more. */
function numbersOf(
  action: ActionRun,
  side: "inputs" | "outputs",
  parameter: string,
): Pick<ParameterRow, "over"> {
  const texts = action.visits.flatMap((visit) => visit[side]?.[parameter] ?? []);
  const over = texts.filter((text) => /^-?\d/.test(text)).map(Number);
  const isChart = over.length >= FEWEST && over.every(Number.isFinite) && new Set(over).size > 1;
  return isChart && over.length === texts.length ? { over } : {};
}

const MOST = 12; // groups of visits side by side; the newest

export function parametersOfVisits(sent: ReportedValues, action: ActionRun): ParametersOfVisits {
  const groups = groupsOf(action, "inputs").slice(-MOST);
  const names = new Set([...Object.keys(sent), ...groups.flatMap((g) => Object.keys(g.values))]);
  const only = groups.length === 1 && action.older + action.visits.length === 1 ? "Ran with" : null;
  return {
    rows: [...names].sort().map((parameter) => ({
      parameter,
      sent: sent[parameter] ?? null,
      ran: groups.map((group) => group.values[parameter] ?? null),
      ...numbersOf(action, "inputs", parameter),
    })),
    visits: groups.map((group) => wordsOf(group, only)),
    unseen: action.visits.filter((visit) => visit.inputs == null).length,
  };
}

/** Return the outputs that answers showed, by visit; no rows where none were seen. */
export function outputsOfVisits(action: ActionRun): Pick<ParametersOfVisits, "rows" | "visits"> {
  const groups = groupsOf(action, "outputs").slice(-MOST);
  const names = new Set(groups.flatMap((group) => Object.keys(group.values)));
  const only = groups.length === 1 && action.older + action.visits.length === 1 ? "Gave" : null;
  return {
    rows: [...names].sort().map((parameter) => ({
      parameter,
      ran: groups.map((group) => group.values[parameter] ?? null),
      ...numbersOf(action, "outputs", parameter),
    })),
    visits: groups.map((group) => wordsOf(group, only)),
  };
}
