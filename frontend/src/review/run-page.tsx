/** One run: its version on the canvas, every visit on the timeline, what was said, how it ended. */

import { Skeleton, Tabs } from "@mantine/core";
import { IconAlertTriangle } from "@tabler/icons-react";
import { ReactFlowProvider } from "@xyflow/react";
import { memo, type ReactNode, useCallback, useEffect, useMemo, useState } from "react";
import { useSearch } from "wouter";
import { errorText } from "../api/http";
import { CONDUCTED } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { useCurrentName } from "../api/people";
import { type ReplayMark, useReplayData, useRunsOfSameStart } from "../api/review";
import { type RunNote, useRunNotes } from "../api/run-notes";
import { type Run, useRun } from "../api/runs";
import { runTimeOf, shiftOfRun } from "../api/site-places";
import { EditorStore, EditorStoreProvider } from "../canvas/editor-store";
import { fromUmrf } from "../canvas/from-umrf";
import { isUnplaced } from "../canvas/geometry/arrange";
import { topDown } from "../canvas/geometry/portrait";
import { GraphView } from "../canvas/graph-view";
import { TopDownButton, useTopDown } from "../canvas/top-down";
import { runMarks } from "../graph/breakpoints";
import type { Key, Position } from "../graph/model";
import { Answers } from "../status/answers";
import { RunQuestions } from "../status/held-notice";
import { rangeOf, type TimeRange, turnedTo } from "../status/lanes/axis";
import { type Lane, lanesOf, useLanes } from "../status/lanes/lanes";
import { Timeline, type Track } from "../status/lanes/timeline";
import { INTO } from "../status/level-places";
import { runEndText, runLabel, useRunStatus } from "../status/progress";
import { useProgress } from "../status/progress-inside";
import { RestList } from "../status/rest-list";
import { RunPoint } from "../status/run-point";
import { useUnsure } from "../status/silence";
import { StartedWith } from "../status/started-with";
import { StateLabel } from "../status/state-label";
import { WaitButton } from "../status/wait-button";
import { withWaits } from "../status/waits";
import { Empty } from "../ui/empty";
import { useIsPhone, useStableCallback } from "../ui/hooks";
import { instant, useNow } from "../ui/times";
import type { Crumb } from "../ui/top-bar";
import { isolated } from "../words/isolated";
import { FailureCauses } from "./causes";
import { HiddenRun } from "./hidden-run";
import { graphsOn, LevelBar, type LevelCursor, useLevel } from "./levels";
import { type ReplayCursor, useReplay } from "./replay";
import { PlayerControls, silentTimesOf, timelineSignsOf } from "./replay-controls";
import { DryRunFromHere, RunActions } from "./run-actions";
import { hasRunMenu, RunCanvasMenu, type RunCanvasPlace } from "./run-canvas-menu";
import { RawEvents, RunEvents } from "./run-events";
import { PinRun, RunFacts, RunNotes, useVersionLabel } from "./run-facts";
import type { RepeatActions } from "./run-menu";
import { noteSigns } from "./run-notes";
import style from "./run-page.module.css";
import { RunParameters } from "./run-parameters";
import { RunPrint } from "./run-print";

export interface RunBarParts {
  crumbs: readonly Crumb[];
  status?: ReactNode;
  actions?: ReactNode;
}

const NO_MARKS: readonly ReplayMark[] = [];
const NO_NOTES: readonly RunNote[] = [];

interface Props {
  id: string;
  bar: (parts: RunBarParts) => ReactNode;
  /** The dialog by which everything is started. */
  start: (again: RepeatActions, onClose: () => void) => ReactNode;
}

/** The moment from which addresses count, ms: the start of a run, or the request for it. */
const originOf = (run: Run): number => instant(run.started_at) ?? instant(run.requested_at) ?? 0;

const FURTHEST = 1e12; // ms, further than any run is long

/** The moment to which a link points, in ms after the start. */
function momentAsked(run: Run, search: string): number | null {
  const t = Number(new URLSearchParams(search).get("t") ?? Number.NaN);
  const isGood = instant(run.started_at) !== null && Math.abs(t) < FURTHEST;
  return isGood ? originOf(run) + t : null;
}

/** The part of the time to which a link points, in ms after the start; null for all of it. */
function rangeAsked(run: Run, search: string): TimeRange | null {
  const query = new URLSearchParams(search);
  const moment = (name: string) => originOf(run) + Number(query.get(name) ?? Number.NaN);
  return rangeOf(moment("from"), moment("until"));
}

/** The part of the time that is shown: it goes on like pages with the replay. */
function useTimeRange(run: Run, { at }: ReplayCursor, search: string) {
  const [range, setRange] = useState(() => rangeAsked(run, search));
  // A replay begins with the request, before anything that the timeline shows.
  const moment = at === null ? null : Math.max(at, originOf(run));
  const shown = range === null || moment === null ? range : turnedTo(range, moment);
  if (shown !== range) setRange(shown);
  return [shown, setRange] as const;
}

/** Keeps the address in step, so that it can be sent to somebody. */
function useAddress(
  run: Run,
  { at, playing }: ReplayCursor,
  { way, key }: LevelCursor,
  range: TimeRange | null,
): void {
  const { id } = run;
  const start = originOf(run);
  useEffect(() => {
    const query = new URLSearchParams();
    for (const { graph, action } of way) query.append("in", `${graph}~${action}`);
    if (at !== null) query.set("t", String(Math.round(at - start)));
    if (key !== null) query.set("action", key);
    if (range !== null) query.set("from", String(range.from - start));
    if (range !== null) query.set("until", String(range.until - start));
    const search = query.size > 0 ? `?${query}` : "";
    if (playing) return; // browsers refuse an address that changes with every frame
    window.history.replaceState(window.history.state, "", `/runs/${id}${search}`);
  }, [id, at, start, playing, way, key, range]);
}

/** The runs that began together with this one, as they are known now. */
function useTracks(runner: string | undefined, run: Run): readonly Track[] {
  const { now } = useLive();
  const mates = useRunsOfSameStart(runner, run).data;
  return useMemo(
    () =>
      (mates ?? []).map((stored) => {
        const live = now.runs.get(stored.id);
        const mate = live ? { ...stored, ...live, umrf: stored.umrf } : stored;
        return { run: mate, lanes: lanesOf(mate, fromUmrf(mate.umrf), mate.engine) };
      }),
    [mates, now.runs],
  );
}

function crumbsOf(run: Run): Crumb[] {
  return [
    { label: "Runs", to: "/runs" },
    {
      label: run.graph_name,
      ...(run.graph === null ? {} : { to: `/graphs/${run.graph}` }),
    },
    { label: `Run ${run.number}` },
  ];
}

/** State of the run, now or at the moment that is shown. */
function RunStatus({ newest, run, past }: RunStatusProps) {
  const now = useRunStatus(run);
  const { tone, word } = runLabel(run);
  const then = { tone, word: run.ended_at === null ? word : runEndText(run) };
  return (
    <>
      <StateLabel pill {...(past ? then : now)} />
      {past && <span className="nowrap ink3 text-xs">as it was then</span>}
      {newest.simulated && <span className="truncate ink3 text-xs">simulated</span>}
    </>
  );
}

interface RunStatusProps {
  newest: Run;
  /** The run at the moment that is shown. */
  run: Run;
  past: boolean;
}

interface AboutRunProps {
  runner: string | undefined;
  newest: Run;
  replay: ReplayCursor;
  label: string;
  marks: readonly ReplayMark[];
  notes: readonly RunNote[];
  /** The chosen action as the run calls it. */
  selected: string | null;
  onSelect: (fact: string | null) => void;
}

/** Parameters, events, notes and raw messages of a run, beside the canvas. */
function AboutRun(props: AboutRunProps) {
  const { runner, newest, replay, label, marks, notes, selected, onSelect } = props;
  const by = useCurrentName(newest.author);
  return (
    <aside className={style.side} aria-label="About the run">
      <RunPrint run={newest} version={label} by={by} />
      <Tabs defaultValue="events" keepMounted={false} className="stack h-full">
        <Tabs.List>
          <Tabs.Tab value="events">Events</Tabs.Tab>
          <Tabs.Tab value="parameters">Parameters</Tabs.Tab>
          <Tabs.Tab value="facts">Facts</Tabs.Tab>
          <Tabs.Tab value="raw">Raw</Tabs.Tab>
        </Tabs.List>
        <Tabs.Panel value="events" className="fill-y overflow-y-auto">
          <RunEvents
            runner={runner}
            run={newest}
            version={label}
            selected={selected}
            onPick={onSelect}
            marks={marks}
            notes={notes}
            at={replay.at}
            onSeek={replay.seek}
          />
        </Tabs.Panel>
        <Tabs.Panel value="parameters" className="fill-y overflow-y-auto">
          <RunParameters run={replay.run} selected={selected} onPick={onSelect} />
        </Tabs.Panel>
        <Tabs.Panel value="facts" className="fill-y overflow-y-auto">
          <RunNotes runner={runner} run={newest.id} />
          <RunFacts runner={runner} run={newest} version={label} by={by} at={replay.at} />
        </Tabs.Panel>
        <Tabs.Panel value="raw" className="fill-y overflow-y-auto">
          <RawEvents runner={runner} run={newest} />
        </Tabs.Panel>
      </Tabs>
    </aside>
  );
}

/** The engines of a run, and of those that began together with it. */
function enginesOf(run: Run, mates: readonly Track[]): string[] {
  if (run.robots) return [CONDUCTED];
  if (run.simulated) return ["simulator"];
  return [run.engine, ...mates.map(({ run: mate }) => mate.engine)].sort();
}

/** The page is drawn with time, the canvas only with what changes on it. */
const RunCanvas = memo(function RunCanvas({ graph, ...props }: Parameters<typeof GraphView>[0]) {
  const isTurnable = useIsPhone() && !isUnplaced(graph);
  const isTurned = useTopDown().isTurned && isTurnable;
  const drawn = useMemo(() => (isTurned ? topDown(graph) : graph), [graph, isTurned]);
  return (
    <ReactFlowProvider key={String(isTurned)}>
      <GraphView graph={drawn} {...props} />
      {isTurnable && (
        <div className={style.turn}>
          <TopDownButton />
        </div>
      )}
    </ReactFlowProvider>
  );
});

/** The arrow that is chosen, if no action is; a chosen action takes its place. */
function usePicked({ key, levels, select: choose }: LevelCursor) {
  const [arrow, setArrow] = useState<string | null>(null);
  const place = `${levels.join("\n")} ${key}`;
  const [before, setBefore] = useState(place);
  if (place !== before) {
    setBefore(place);
    if (key !== null) setArrow(null);
  }
  const pickArrow = useCallback(
    (id: string) => {
      choose(null);
      setArrow(id);
    },
    [choose],
  );
  const select = useCallback(
    (chosen: Key | null) => {
      setArrow(null);
      choose(chosen);
    },
    [choose],
  );
  return { arrow, pickArrow, select };
}

/** Return a store that marks where the run waits, on the graph that was sent with it. */
function useRunMarks({ breakpoints }: Run, { graph, levels }: LevelCursor): EditorStore {
  const [store] = useState(() => new EditorStore());
  const isTop = levels.length === 0;
  useEffect(
    () => store.breakpoints.set(runMarks(graph, (isTop && breakpoints) || [])),
    [store, graph, isTop, breakpoints],
  );
  return store;
}

interface RunTimelineProps {
  newest: Run;
  replay: ReplayCursor;
  replayData: Parameters<typeof timelineSignsOf>[0];
  unsure: boolean;
  level: LevelCursor;
  /** The runs that began together with this one. */
  mates: readonly Track[];
  range: TimeRange | null;
  onRange: (range: TimeRange | null) => void;
  notes: readonly RunNote[];
}

/** Every visit, and the controls of the replay. */
function RunTimeline(props: RunTimelineProps) {
  const { newest, replay, replayData, unsure, level, mates } = props;
  const { now } = useLive();
  const { graph } = level.sent.top;
  const lanes = useLanes(newest, graph, mates.length > 0 ? newest.engine : "");
  const { sent, pick } = level;
  const onPick = useCallback(({ name }: Lane) => pick(name), [pick]);
  const picks = useCallback(
    ({ aid, levels }: Lane) =>
      aid !== null || (levels.length > 0 && graphsOn(sent, levels) !== null),
    [sent],
  );
  const silent = instant(newest.unknown_since);
  const until = instant(newest.ended_at) ?? silent ?? replay.end;
  const { notes } = props;
  const signs = useMemo(
    () => [...timelineSignsOf(replayData), ...noteSigns(notes)],
    [replayData, notes],
  );
  const gaps = useMemo(() => silentTimesOf(replayData, newest, until), [replayData, newest, until]);
  return (
    <section className={style.strip} aria-label="Timeline">
      <PlayerControls replay={replay} goes={newest.ended_at === null}>
        <DryRunFromHere run={newest} at={replay.at} />
      </PlayerControls>
      {replay.failed !== null && (
        <p className="m-0 ink-error text-12" role="alert">
          The replay cannot be loaded: {errorText(replay.failed)}
        </p>
      )}
      <Timeline
        run={newest}
        lanes={lanes}
        silentSince={unsure ? runTimeOf(newest.id, now.since) : silent}
        selected={level.fact}
        onPick={onPick}
        picks={picks}
        cursor={replay.at}
        onSeek={replay.seek}
        signs={signs}
        gaps={gaps}
        others={mates}
        range={props.range}
        onRange={props.onRange}
      />
    </section>
  );
}

function canvasLabel({ graph_name }: Run, { levels }: LevelCursor, version: string): string {
  const inside = levels.length > 0 ? `, inside ${levels.join(INTO)}` : "";
  return `Version ${version} of ${isolated(graph_name)}${inside}`;
}

function Shown({ run: newest, bar, start }: { run: Run } & Omit<Props, "id">) {
  const { now: live, runner } = useLive(newest.id);
  const search = useSearch();
  const level = useLevel(newest, search);
  const goes = newest.ended_at === null;
  const unsure = goes && live.link === "down";
  const present = useNow(1000, goes) - shiftOfRun(newest.id);
  const until = unsure ? runTimeOf(newest.id, live.since) : (instant(newest.ended_at) ?? present);
  const replay = useReplay(runner, newest, until, momentAsked(newest, search));
  const { run } = replay;
  const past = replay.at !== null;
  const [range, setRange] = useTimeRange(newest, replay, search);
  useAddress(newest, replay, level, range);
  const unheard = useUnsure(newest);
  const seen = useProgress(run, !past && unheard, replay.at, level.inside);
  const progress = useMemo(() => withWaits(level.graph, seen), [level.graph, seen]);
  const mates = useTracks(runner, newest);
  const engines = useMemo(() => enginesOf(newest, mates), [newest, mates]);
  const [again, setAgain] = useState<RepeatActions | null>(null);
  const { arrow, pickArrow, select } = usePicked(level);
  const point = arrow ?? level.key;
  const picked = useMemo(() => new Set(point === null ? [] : [point]), [point]);
  const store = useRunMarks(newest, level);
  const isLedNow = Boolean(newest.robots) && goes && level.levels.length === 0;
  const [menu, setMenu] = useState<RunCanvasPlace | null>(null);
  const isMenuHere = !past && level.levels.length === 0;
  const openMenu = useStableCallback((id: string, screen: Position) => {
    if (!isMenuHere || !hasRunMenu(newest, level.graph, id)) return false;
    if (level.graph.actions.some((each) => each.key === id)) select(id);
    else if (isLedNow) pickArrow(id);
    setMenu({ id, screen });
    return true;
  });
  const replayData = useReplayData(runner, newest.id, 0, true).data;
  const notes = useRunNotes(runner, newest.id).data ?? NO_NOTES;
  const label = useVersionLabel(newest);
  const show = (at: number, fact: string | null) => {
    replay.seek(at);
    if (fact !== null) level.pick(fact);
  };
  const isPhone = useIsPhone(); // the bar has no room for the actions of the page
  const actions = (
    <>
      <WaitButton run={newest} />
      <PinRun runner={runner} run={newest.id} />
      <RunActions runner={runner} run={newest} engines={engines} onStart={setAgain} />
    </>
  );
  return (
    <>
      {bar({
        crumbs: crumbsOf(newest),
        status: <RunStatus newest={newest} run={run} past={past} />,
        actions: isPhone ? null : actions,
      })}
      <main className={style.page}>
        <div className={style.why}>
          {isPhone && <div className={style.tools}>{actions}</div>}
          <StartedWith run={newest} />
          <Answers run={newest} />
          <RunQuestions run={newest} />
          {isLedNow && !past && <RunPoint run={newest} graph={level.graph} id={point} />}
          <RestList run={newest} />
          <FailureCauses runner={runner} run={newest} onShow={show} />
        </div>
        <section className={style.canvas} aria-label="Graph of the run" data-under-stop-notice>
          <EditorStoreProvider store={store}>
            <RunCanvas
              key={level.levels.join("\n")}
              graph={level.graph}
              progress={progress}
              selected={picked}
              onSelect={select}
              onSelectArrow={isLedNow ? pickArrow : undefined}
              onMenu={isMenuHere ? openMenu : undefined}
              label={canvasLabel(newest, level, label)}
            />
          </EditorStoreProvider>
          <LevelBar level={level} name={newest.graph_name} />
        </section>
        <RunTimeline
          newest={newest}
          replay={replay}
          replayData={replayData}
          unsure={unsure}
          level={level}
          mates={mates}
          range={range}
          onRange={setRange}
          notes={notes}
        />
        <AboutRun
          runner={runner}
          newest={newest}
          replay={replay}
          label={label}
          marks={replayData?.marks ?? NO_MARKS}
          notes={notes}
          selected={level.fact}
          onSelect={level.pick}
        />
      </main>
      {menu !== null && isMenuHere && (
        <RunCanvasMenu
          key={menu.id}
          {...{ run: newest, graph: level.graph, place: menu, engines }}
          onStart={setAgain}
          onClose={() => setMenu(null)}
        />
      )}
      {again !== null && start(again, () => setAgain(null))}
    </>
  );
}

export function RunPage({ id, bar, start }: Props) {
  const { runner, now } = useLive();
  const stored = useRun(runner, id);
  const live = now.runs.get(id);
  const run = useMemo(() => {
    if (!stored.data) return null;
    return live ? { ...stored.data, ...live, umrf: stored.data.umrf } : stored.data;
  }, [stored.data, live]);
  const { refetch } = stored;
  const isHidden = (live ?? stored.data)?.hidden === true;
  const isBack = stored.data?.hidden === true && live !== undefined && !isHidden;
  useEffect(() => {
    if (isBack) void refetch();
  }, [isBack, refetch]);
  if (run !== null && (isHidden || isBack)) {
    const crumbs = [{ label: "Runs", to: "/runs" }, { label: `Run ${run.number}` }];
    return (
      <>
        {bar({ crumbs, status: <RunStatus newest={run} run={run} past={false} /> })}
        <main className="page">
          <HiddenRun run={run} />
        </main>
      </>
    );
  }
  if (run !== null) return <Shown run={run} bar={bar} start={start} />;
  const crumbs = [{ label: "Runs", to: "/runs" }, { label: "Run" }];
  return (
    <>
      {bar({ crumbs })}
      <main className={style.page}>
        {stored.isError ? (
          <Empty icon={<IconAlertTriangle size={22} />} title="This run cannot be shown">
            {errorText(stored.error)}
          </Empty>
        ) : (
          <section className={style.canvas} aria-busy="true">
            <Skeleton height="100%" radius={0} />
          </section>
        )}
      </main>
    </>
  );
}
