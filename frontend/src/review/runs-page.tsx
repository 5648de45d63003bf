/** List of runs, newest first: who started them, when, how long they took and how they ended. */

import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconAlertTriangle,
  IconArrowsDiff,
  IconChartBar,
  IconHistory,
  IconSearch,
} from "@tabler/icons-react";
import { useInfiniteQuery, useMutation } from "@tanstack/react-query";
import { useCallback, useMemo, useState } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { errorText } from "../api/http";
import { CONDUCTED, enginesOf } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { useRepeats } from "../api/repeats";
import {
  filterOf,
  importExamples,
  type ListedRun,
  listRuns,
  queryOf,
  type RunFilter,
} from "../api/review";
import type { Run } from "../api/runs";
import { type Site, siteOfId } from "../api/sites";
import { SilentSites } from "../status/silent-sites";
import { Empty } from "../ui/empty";
import { QueueLink } from "./queue-page";
import { RunFilters } from "./run-filters";
import { RunList, type RunOfList } from "./run-list";
import style from "./runs-page.module.css";

const PAGE = 100;

/** The stored list with what the live socket knows better, in the order in which it was asked for. */
function overlaid(stored: readonly ListedRun[], live: ReadonlyMap<string, Run>): RunOfList[] {
  return stored.map((run) => {
    const now = live.get(run.id);
    if (now === undefined) return run;
    const archived = now.archived ?? run.archived;
    return { ...run, ...now, archived, hidden: now.hidden === true };
  });
}

/** Runs that began after the list was asked for. They wait behind a pill: nothing moves by itself. */
function newcomers(stored: readonly ListedRun[], live: ReadonlyMap<string, Run>): number {
  const known = new Set(stored.map((run) => run.id));
  const newest = new Map<Site | undefined, number>(); // each runner counts its own
  for (const { id, number } of [...stored].reverse()) newest.set(siteOfId(id), number);
  const isNew = (run: Run) => run.number > (newest.get(siteOfId(run.id)) ?? 0);
  return [...live.values()].filter((run) => isNew(run) && !known.has(run.id)).length;
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

/** Link to the repeats; nothing while there are none. */
function RepeatsLink() {
  const { runner } = useLive();
  const found = useRepeats(runner);
  if (!found.data?.length) return null;
  return (
    <Button component={Link} to="/runs/repeats" size="compact-sm" variant="subtle">
      Repeats
    </Button>
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
  const waiting = listed.isSuccess ? newcomers(stored, now.runs) : 0;
  const filtered = queryOf(filter).size > 0;
  const engines = useMemo(() => engineChoices(stored, filter.robot), [stored, filter.robot]);
  const choose = (run: string, on: boolean) =>
    setChosen(on ? [...chosen.slice(-1), run] : chosen.filter((each) => each !== run));
  const [b = "", a = ""] = [...chosen].sort((x, y) => placeOf(runs, x) - placeOf(runs, y));
  return (
    <main className="page">
      <div className={style.inner}>
        <div className="page-head">
          <h2 className="page-title">Runs</h2>
          <RunFilters runner={runner} filter={filter} onChange={setFilter} engines={engines} />
        </div>
        <div className={style.buttons} aria-live="polite">
          <RepeatsLink />
          <QueueLink />
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
        <SilentSites route="get /api/runs" missing="some of its runs are missing here" />
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
        {runs.length > 0 && (
          <RunList
            runs={runs}
            chosen={chosen}
            onChoose={choose}
            isGapless={isGapless(filter)}
            goesOn={listed.hasNextPage}
          />
        )}
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

/** Return whether a filter leaves out no run of a graph that it shows, but for older ones. */
function isGapless(filter: RunFilter): boolean {
  return queryOf({ ...filter, graph: "", until: "" }).size === 0;
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

/** The newest stands first. */
function placeOf(runs: readonly ListedRun[], id: string): number {
  return runs.findIndex((run) => run.id === id);
}
