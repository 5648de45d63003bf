/** Rows of the list of runs, by day: how each ended and why, its course, and the run before to compare with. */

import { ActionIcon, Checkbox } from "@mantine/core";
import { IconArrowsDiff, IconChartBar, IconPinFilled } from "@tabler/icons-react";
import { type MouseEvent, useEffect, useId, useMemo, useRef } from "react";
import { Link, useLocation } from "wouter";
import { useCurrentName } from "../api/people";
import type { ListedRun } from "../api/review";
import { hasEnded } from "../api/run-stop";
import { type Run, runPlace } from "../api/runs";
import { shiftOfRun } from "../api/site-places";
import { siteOfId } from "../api/sites";
import { boundsText } from "../status/durations";
import { fromWords } from "../status/earlier-list";
import { useRunStatus } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { valuesWords } from "../status/value-words";
import { keyOf } from "../ui/keys";
import { clock, day, instant, stopwatch, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import { CourseBar } from "./course-bar";
import { useVersionLabel } from "./run-facts";
import style from "./run-list.module.css";

/** A stored run, with the actions that the live socket knows of it. */
export type RunOfList = ListedRun & Pick<Run, "actions">;

/** Return the runs by the day on which they were asked for, which is their order, with a key for each day. */
export function byDay(runs: readonly RunOfList[], now: number) {
  const days: { key: string; day: string; runs: RunOfList[] }[] = [];
  for (const run of runs) {
    const of = day(instant(run.requested_at) ?? now, now);
    const last = days.at(-1);
    if (last?.day === of) last.runs.push(run);
    // A clock that was set back gives a day twice.
    else {
      const key = days.some((other) => other.key === of) ? `${of} ${run.id}` : of;
      days.push({ key, day: of, runs: [run] });
    }
  }
  return days;
}

/**
 * Return the run of the same graph before each run, by its id, as far as it is in the list.
 * `runs`: the newest first, and none left out by a filter.
 */
export function runsBefore(runs: readonly RunOfList[]): ReadonlyMap<string, RunOfList> {
  const before = new Map<string, RunOfList>();
  const later = new Map<string, RunOfList>();
  for (const run of runs) {
    if (run.hidden === true) continue;
    const key = `${run.graph ?? run.graph_name} ${siteOfId(run.id)?.url}`; // a site compares its own
    const next = later.get(key);
    if (next !== undefined) before.set(next.id, run);
    later.set(key, run);
  }
  return before;
}

/** Shows what people have noted of a run, and what it was started with. */
function Marks({ run }: { run: ListedRun }) {
  return (
    <>
      {run.pinned && <IconPinFilled size={12} aria-label="pinned" className={style.pin} />}
      {run.labels?.map((each) => (
        <span key={each} className={style.label}>
          {each}
        </span>
      ))}
      {run.from && <span className={style.more}>{fromWords(run.from)}</span>}
      {run.values && (
        <span className={style.more} title={valuesWords(run.values)}>
          with {valuesWords(run.values)}
        </span>
      )}
    </>
  );
}

/** Buttons of a row that do not open its run. */
function RowLinks({ run, before }: { run: ListedRun; before: RunOfList | null | undefined }) {
  const stay = (event: MouseEvent) => event.stopPropagation();
  if (run.hidden || run.graph === null) return null;
  const query = new URLSearchParams({ ...(before ? { a: before.id } : {}), b: run.id });
  const words = before ? `with ${before.number}` : "with the run before";
  return (
    <>
      <ActionIcon
        component={Link}
        to={`/runs/statistics?graph=${encodeURIComponent(run.graph)}`}
        size={24}
        variant="subtle"
        color="gray"
        className={style.rare ?? ""}
        aria-label="Statistics of its graph"
        title={`Statistics of ${isolated(run.graph_name)}`}
        onClick={stay}
      >
        <IconChartBar size={15} aria-hidden />
      </ActionIcon>
      {before !== null && (
        <Link
          to={`/runs/compare?${query}`}
          className={style.with}
          aria-label={`Compare ${words}`}
          title={`Compare ${words}`}
          onClick={stay}
        >
          <IconArrowsDiff size={13} aria-hidden />
          {before && <span>{words}</span>}
        </Link>
      )}
    </>
  );
}

const siteName = (run: string) => {
  const site = siteOfId(run);
  return site ? ` · ${isolated(site.name)}` : "";
};

/** Return why a run cannot be compared with the chosen ones; "" if it can. */
export function comparisonObstacle(run: string, chosen: readonly string[]): string {
  const site = siteOfId(run);
  const other = chosen.map(siteOfId).find((each) => each !== site);
  if (other === undefined || site === undefined) return "";
  return `Only runs of ${isolated(other.name)} can be chosen: those of two sites are not compared.`;
}

interface RunRowProps {
  run: RunOfList;
  /** The present by the clock of the run's runner. */
  now: number;
  chosen: boolean;
  /** The id of the text that says why it cannot be chosen; undefined if it can. */
  obstacle: string | undefined;
  onChoose: (chosen: boolean) => void;
  /** Null: there is none. Undefined: it is not in the list. */
  before: RunOfList | null | undefined;
}

function Row({ run, now, chosen, obstacle, onChoose, before }: RunRowProps) {
  const [, go] = useLocation();
  const by = useCurrentName(run.author);
  const label = useVersionLabel(run);
  const { tone, word } = useRunStatus(run);
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  const over = end === null ? null : (boundsText(run.took) ?? "—");
  const took = over ?? (start === null || tone === "unknown" ? "" : stopwatch(now - start));
  const to = `/runs/${run.id}`;
  return (
    <tr className={style.row} onClick={() => go(to)}>
      {/* biome-ignore lint/a11y/useKeyWithClickEvents: keeps a near miss of the box from leaving */}
      <td className={style.choose} onClick={(event) => event.stopPropagation()}>
        <Checkbox
          size="xs"
          aria-label={`Choose run ${run.number} to compare`}
          checked={chosen}
          disabled={run.hidden === true || obstacle !== undefined}
          aria-describedby={obstacle}
          onChange={(event) => onChoose(event.currentTarget.checked)}
        />
      </td>
      <td className={style.run}>
        <Link
          to={to}
          className="ink-inherit weight-500 no-underline rounded-4"
          data-run
          onClick={(event) => event.stopPropagation()}
        >
          <span className={style.number}>Run {run.number}</span>{" "}
          {run.hidden ? (
            <span className="ink3">
              of <bdi>{run.graph_name}</bdi>
            </span>
          ) : (
            <bdi>{run.graph_name}</bdi>
          )}
        </Link>{" "}
        {!run.hidden && (
          <>
            <span className={style.version}>{label}</span>
            <Marks run={run} />
          </>
        )}
      </td>
      <td className={style.result}>
        <StateLabel tone={tone} word={word} />
        {!run.hidden && run.cause && <span className={style.cause}>{run.cause}</span>}
      </td>
      <td className={style.course}>{!run.hidden && <CourseBar run={run} now={now} />}</td>
      <td className={style.fact}>
        {runPlace(run)}
        {siteName(run.id)}
      </td>
      <td className={style.fact}>{by}</td>
      <td className={style.fact}>{start !== null && clock(start)}</td>
      <td className={style.took}>{took}</td>
      <td className={style.links}>
        <RowLinks run={run} before={before} />
      </td>
    </tr>
  );
}

/** j and k go to the next and the previous row, wherever nobody is typing; Enter opens it, as a link. */
function useRowKeys() {
  const table = useRef<HTMLTableElement>(null);
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const step = new Map([
        ["j", 1],
        ["k", -1],
      ]).get(keyOf(event));
      const typed = "input:not([type=checkbox]), textarea, select, [role=dialog], [role=menu]";
      const busy = event.target instanceof Element && event.target.closest(typed) !== null;
      if (step === undefined || busy || event.defaultPrevented) return;
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const rows = [...(table.current?.querySelectorAll<HTMLElement>("a[data-run]") ?? [])];
      const here = document.activeElement?.closest("tr");
      const at = rows.findIndex((each) => here?.contains(each));
      const next = rows[at === -1 ? 0 : at + step];
      next?.focus();
      next?.scrollIntoView({ block: "nearest" });
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
  return table;
}

interface RowsProps {
  runs: readonly RunOfList[];
  chosen: readonly string[];
  onChoose: (run: string, chosen: boolean) => void;
  /** Each run of the graphs is in the list, down to its last row. */
  isGapless: boolean;
  /** The list goes on below its last row. */
  goesOn: boolean;
}

const COLUMNS = 9;

export function RunList({ runs, chosen, onChoose, isGapless, goesOn }: RowsProps) {
  const going = runs.some((run) => !hasEnded(run));
  const now = useNow(going ? 1000 : 30_000);
  const table = useRowKeys();
  const before = useMemo(() => runsBefore(isGapless ? runs : []), [runs, isGapless]);
  const isLast = isGapless && !goesOn;
  const reasonId = useId();
  const obstacles = new Map(runs.map(({ id }) => [id, comparisonObstacle(id, chosen)]));
  const reason = [...obstacles.values()].find((each) => each !== "");
  return (
    <div>
      <div role="status" id={reasonId}>
        {reason !== undefined && <p className="m-0 quiet-12">{reason}</p>}
      </div>
      <div className="border bg-panel rounded-card shadow scroll-x">
        <table ref={table} className={style.table} data-choosing={chosen.length > 0 || undefined}>
          <thead>
            <tr>
              <th>
                <span className={style.hidden}>Compare</span>
              </th>
              <th>Run</th>
              <th>Result</th>
              <th>Course</th>
              <th>On</th>
              <th>Started by</th>
              <th>Started</th>
              <th className={style.took}>Took</th>
              <th>
                <span className={style.hidden}>More</span>
              </th>
            </tr>
          </thead>
          {byDay(runs, now).map((group) => (
            <tbody key={group.key}>
              <tr className={style.day}>
                <th scope="rowgroup" colSpan={COLUMNS}>
                  {group.day}
                </th>
              </tr>
              {group.runs.map((run) => (
                <Row
                  key={run.id}
                  run={run}
                  now={now - shiftOfRun(run.id)}
                  chosen={chosen.includes(run.id)}
                  obstacle={obstacles.get(run.id) ? reasonId : undefined}
                  onChoose={(on) => onChoose(run.id, on)}
                  before={before.get(run.id) ?? (isLast ? null : undefined)}
                />
              ))}
            </tbody>
          ))}
        </table>
      </div>
    </div>
  );
}
