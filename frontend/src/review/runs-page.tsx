/** List of runs, newest first: who started them, when, how long they took and how they ended. */

import { ActionIcon, Button, Checkbox, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconAlertTriangle,
  IconArrowsDiff,
  IconChartBar,
  IconHistory,
  IconPinFilled,
  IconSearch,
} from "@tabler/icons-react";
import { useInfiniteQuery, useMutation } from "@tanstack/react-query";
import { type MouseEvent, useCallback, useMemo, useState } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { errorText } from "../api/http";
import { CONDUCTED, enginesOf } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { useCurrentName } from "../api/people";
import {
  filterOf,
  importExamples,
  type ListedRun,
  listRuns,
  queryOf,
  type RunFilter,
} from "../api/review";
import { hasEnded } from "../api/run-stop";
import { type Run, runPlace } from "../api/runs";
import { boundsText } from "../status/durations";
import { fromWords } from "../status/earlier-list";
import { useRunStatus } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { valuesWords } from "../status/value-words";
import { Empty } from "../ui/empty";
import { clock, day, instant, stopwatch, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import { useVersionLabel } from "./run-facts";
import { RunFilters } from "./run-filters";
import style from "./runs-page.module.css";

const PAGE = 100;

/** The stored list with what the live socket knows better, in the order in which it was asked for. */
function overlaid(stored: readonly ListedRun[], live: ReadonlyMap<string, Run>): ListedRun[] {
  return stored.map((run) => {
    const now = live.get(run.id);
    if (now === undefined) return run;
    const archived = now.archived ?? run.archived;
    return { ...run, ...now, archived, hidden: now.hidden === true };
  });
}

/** Runs that began after the list was asked for. They wait behind a pill: nothing moves by itself. */
function newcomers(
  stored: readonly ListedRun[],
  live: ReadonlyMap<string, Run>,
  newest: number,
): number {
  const known = new Set(stored.map((run) => run.id));
  return [...live.values()].filter((run) => run.number > newest && !known.has(run.id)).length;
}

interface RunRowProps {
  run: ListedRun;
  now: number;
  chosen: boolean;
  onChoose: (chosen: boolean) => void;
}

/** Shows what people, and the runner after its end, have noted of a run, and what it was started with. */
function Marks({ run }: { run: ListedRun }) {
  return (
    <>
      {run.pinned && <IconPinFilled size={12} aria-label="pinned" className={style.pin} />}
      {run.labels?.map((each) => (
        <span key={each} className={style.label}>
          {each}
        </span>
      ))}
      {run.from && <span className={style.cause}>{fromWords(run.from)}</span>}
      {run.values && (
        <span className={style.cause} title={valuesWords(run.values)}>
          with {valuesWords(run.values)}
        </span>
      )}
      {run.cause && <span className={style.cause}>{run.cause}</span>}
    </>
  );
}

function Row({ run, now, chosen, onChoose }: RunRowProps) {
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
          disabled={run.hidden === true}
          onChange={(event) => onChoose(event.currentTarget.checked)}
        />
      </td>
      <td className={style.state}>
        <StateLabel tone={tone} word={word} />
      </td>
      <td>
        <Link
          to={to}
          className="ink-inherit weight-500 no-underline rounded-4"
          onClick={(event) => event.stopPropagation()}
        >
          <span className={style.number}>Run {run.number}</span>{" "}
          {run.hidden ? (
            <span className="ink3">
              of <bdi>{run.graph_name}</bdi>
            </span>
          ) : (
            run.graph_name
          )}
        </Link>
        {!run.hidden && <Marks run={run} />}
      </td>
      <td>{!run.hidden && <span className={style.version}>{label}</span>}</td>
      <td className="ink2">{runPlace(run)}</td>
      <td>{by}</td>
      <td className="ink2">{start !== null && `${day(start, now)} ${clock(start)}`}</td>
      <td className={style.took}>{took}</td>
      <td className={style.figures}>
        {run.graph !== null && (
          <ActionIcon
            component={Link}
            to={`/runs/statistics?graph=${encodeURIComponent(run.graph)}`}
            size={24}
            variant="subtle"
            color="gray"
            aria-label="Statistics of its graph"
            title={`Statistics of ${isolated(run.graph_name)}`}
            onClick={(event: MouseEvent) => event.stopPropagation()}
          >
            <IconChartBar size={15} aria-hidden />
          </ActionIcon>
        )}
      </td>
    </tr>
  );
}

interface RowsProps {
  runs: readonly ListedRun[];
  chosen: readonly string[];
  onChoose: (run: string, chosen: boolean) => void;
}

function Rows({ runs, chosen, onChoose }: RowsProps) {
  const going = runs.some((run) => !hasEnded(run));
  const now = useNow(going ? 1000 : 30_000);
  return (
    <div className="border bg-panel rounded-card shadow scroll-x">
      <table className={style.table}>
        <thead>
          <tr>
            <th>
              <span className={style.hidden}>Compare</span>
            </th>
            <th>State</th>
            <th>Run</th>
            <th>Version</th>
            <th>On</th>
            <th>Started by</th>
            <th>Started</th>
            <th className={style.took}>Took</th>
            <th>
              <span className={style.hidden}>Statistics</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {runs.map((run) => (
            <Row
              key={run.id}
              run={run}
              now={now}
              chosen={chosen.includes(run.id)}
              onChoose={(on) => onChoose(run.id, on)}
            />
          ))}
        </tbody>
      </table>
    </div>
  );
}

/** Pages of the list. They are asked for anew only when somebody wants to. */
function useListed(runner: string | undefined, filter: RunFilter) {
  return useInfiniteQuery({
    queryKey: ["runs", "list", "page", queryOf(filter).toString()],
    queryFn: ({ pageParam, signal }) => listRuns(runner ?? "", filter, pageParam, PAGE, signal),
    initialPageParam: null as string | null,
    getNextPageParam: (last) => (last.length < PAGE ? undefined : last.at(-1)?.id),
    enabled: runner !== undefined,
    refetchOnWindowFocus: false,
  });
}

function Waiting() {
  return (
    <div aria-hidden>
      {[0, 1, 2, 3, 4].map((i) => (
        <Skeleton key={i} height={40} mb={6} />
      ))}
    </div>
  );
}

/** Recorded runs that failed: how this page finds out why can be seen without a robot. */
function BringExamples({ runner, onDone }: { runner: string | undefined; onDone: () => void }) {
  const bring = useMutation({
    mutationFn: () => importExamples(runner ?? ""),
    onSuccess: onDone,
    onError: (error) =>
      notifications.show({ color: "red", title: "Not taken in", message: errorText(error) }),
  });
  return (
    <Button
      variant="default"
      disabled={runner === undefined}
      loading={bring.isPending}
      onClick={() => bring.mutate()}
    >
      Show five recorded runs that failed
    </Button>
  );
}

interface NoRunsProps {
  runner: string | undefined;
  failed: Error | null;
  isKnown: boolean;
  filtered: boolean;
  /** Some began since the list was asked for. */
  isNew: boolean;
  onChanged: () => void;
}

/** Explains why the list is empty. */
function NoRuns({ runner, failed, isKnown, filtered, isNew, onChanged }: NoRunsProps) {
  if (failed !== null) {
    return (
      <Empty icon={<IconAlertTriangle size={22} />} title="The list of runs could not be loaded">
        {errorText(failed)} Recorded runs are safe; they are shown again when the runner answers.
      </Empty>
    );
  }
  if (!isKnown) return null;
  if (filtered) {
    return (
      <Empty icon={<IconSearch size={22} />} title="No run fits">
        No run matches this search and filter. A text is searched for in names of graphs, robots,
        people and actions, in notes, in the number of a run, and in what its events say: causes,
        alarms, messages, reasons. Values of parameters are not searched. Of a run that goes on,
        only names are searched.
      </Empty>
    );
  }
  if (isNew) return null;
  return (
    <Empty
      icon={<IconHistory size={22} />}
      title="Nothing ran yet"
      action={<BringExamples runner={runner} onDone={onChanged} />}
    >
      Open a graph and hold <b>Start</b>. Every run is kept here, with its exact version and what
      each action did.
    </Empty>
  );
}

export function RunsPage() {
  const { runner, now } = useLive();
  const [, go] = useLocation();
  const search = useSearch();
  const filter = useMemo(() => filterOf(new URLSearchParams(search)), [search]);
  const setFilter = useCallback(
    (next: RunFilter) =>
      go(`/runs${queryOf(next).size ? `?${queryOf(next)}` : ""}`, { replace: true }),
    [go],
  );
  const listed = useListed(runner, filter);
  const [chosen, setChosen] = useState<readonly string[]>([]);
  const stored = useMemo(() => listed.data?.pages.flat() ?? [], [listed.data]);
  const runs = useMemo(() => overlaid(stored, now.runs), [stored, now.runs]);
  const newest = stored[0]?.number ?? 0;
  const waiting = listed.isSuccess ? newcomers(stored, now.runs, newest) : 0;
  const filtered = queryOf(filter).size > 0;
  const engines = useMemo(() => engineChoices(stored, filter.robot), [stored, filter.robot]);
  const choose = (run: string, on: boolean) =>
    setChosen(on ? [...chosen.slice(-1), run] : chosen.filter((each) => each !== run));
  const [b = "", a = ""] = [...chosen].sort((x, y) => numberOf(runs, y) - numberOf(runs, x));
  return (
    <main className="page">
      <div className={style.inner}>
        <div className="page-head">
          <h2 className="page-title">Runs</h2>
          <RunFilters runner={runner} filter={filter} onChange={setFilter} engines={engines} />
        </div>
        <div className={style.buttons} aria-live="polite">
          <Button component={Link} to="/runs/repeats" size="compact-sm" variant="subtle">
            Repeats
          </Button>
          {waiting > 0 && (
            <Button size="compact-sm" variant="light" onClick={() => void listed.refetch()}>
              {waiting === 1 ? "1 new run" : `${waiting} new runs`}
            </Button>
          )}
          {chosen.length > 0 && (
            <Button
              size="compact-sm"
              variant="default"
              leftSection={<IconArrowsDiff size={14} aria-hidden />}
              onClick={() =>
                go(`/runs/compare?${new URLSearchParams(a === "" ? { b } : { a, b })}`)
              }
            >
              {chosen.length === 2 ? "Compare the two" : "Compare with …"}
            </Button>
          )}
          {filter.graph !== "" && (
            <Button
              component={Link}
              size="compact-sm"
              variant="default"
              to={`/runs/statistics?graph=${encodeURIComponent(filter.graph)}`}
              leftSection={<IconChartBar size={14} aria-hidden />}
            >
              Statistics
            </Button>
          )}
        </div>
        {listed.isPending && <Waiting />}
        {runs.length === 0 && (
          <NoRuns
            runner={runner}
            failed={listed.error}
            isKnown={listed.isSuccess}
            filtered={filtered}
            isNew={waiting > 0}
            onChanged={() => void listed.refetch()}
          />
        )}
        {runs.length > 0 && <Rows runs={runs} chosen={chosen} onChoose={choose} />}
        {listed.hasNextPage && (
          <Button
            variant="default"
            loading={listed.isFetchingNextPage}
            onClick={() => void listed.fetchNextPage()}
          >
            Show older runs
          </Button>
        )}
      </div>
    </main>
  );
}

/** Return the engines by which runs can be filtered: those of the listed runs, and the chosen one. */
function engineChoices(runs: readonly ListedRun[], chosen: string): string[] {
  return [
    ...new Set([
      "simulator",
      chosen,
      ...runs.flatMap((run) => (run.robots ? [CONDUCTED, ...enginesOf(run)] : [run.engine])),
    ]),
  ].filter(Boolean);
}

function numberOf(runs: readonly ListedRun[], id: string): number {
  return runs.find((run) => run.id === id)?.number ?? 0;
}
