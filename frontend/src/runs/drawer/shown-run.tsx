/** A run in the drawer: its head, a tab for each robot, and what they show while it is open. */

import { Tabs } from "@mantine/core";
import { useCallback, useMemo, useState } from "react";
import { enginesOf } from "../../api/led-runs";
import { silentRobots } from "../../api/live-socket";
import { useLive } from "../../api/page-link";
import { silentRests } from "../../api/run-stop";
import { type ActionRun, currentAlarm, type Run, type Visit } from "../../api/runs";
import { runTimeOf } from "../../api/site-places";
import type { Graph } from "../../graph/model";
import { Answers } from "../../status/answers";
import { RunQuestions } from "../../status/held-notice";
import { isRobot, type Lane, performerWords, robotsOf, useLanes } from "../../status/lanes/lanes";
import { Timeline, type Track } from "../../status/lanes/timeline";
import { spokenIn } from "../../status/level-places";
import { resultTone, runLabel, type Tone, visitEnd } from "../../status/progress";
import { RestList } from "../../status/rest-list";
import { knownRest, type RobotRest, restWords } from "../../status/rests";
import { RunPoint } from "../../status/run-point";
import { StartedWith } from "../../status/started-with";
import { StateLabel } from "../../status/state-label";
import { colorOfName } from "../../ui/name-colors";
import { instant } from "../../ui/times";
import { movingActions } from "../moves-now";
import { useSentGraph } from "../sent-graph";
import style from "./run-drawer.module.css";
import { ConfirmRestButton, RunHead } from "./run-head";
import { ValuesPanel } from "./values-panel";

/** Alarms that the notice of STOP already shows on every page. */
const SHOUTED: ReadonlySet<string> = new Set(["stop_unconfirmed", "moves_again"]);
const SHORT = 60; // characters that fit beside the rest

export interface ShownRunProps {
  run: Run;
  /** All runs of this graph that go on; the canvas shows one. */
  going: readonly Run[];
  onChoose: (run: string) => void;
  graph: Graph;
  versionLabel: string;
  selected: string | null;
  /** The only chosen action or arrow. */
  point: string | null;
  onPick: (aid: string) => void;
  /** The moment of the run that the canvas shows, ms; null for the present. */
  cursor: number | null;
  onSeek: (at: number | null) => void;
  /** Only the head is shown; null: it cannot be folded. */
  folded: boolean | null;
  onFold: (folded: boolean) => void;
}

/** Return what a person must know of the run now, or why it ended this way. */
function toldOf(run: Run): string {
  const alarm = currentAlarm(run)?.text ?? "";
  return run.ended_at === null ? alarm : run.detail || alarm;
}

function RobotTabList({ tabs }: { tabs: readonly RobotTab[] }) {
  return (
    <Tabs.List className={style.tabs ?? ""} aria-label="Who runs this graph">
      <Tabs.Tab value={ALL_ROBOTS}>{allWords(tabs)}</Tabs.Tab>
      {tabs.map(({ id, robot, actor, tone, words }) => (
        <Tabs.Tab key={id} value={id}>
          <span className={style.robot}>
            <i style={{ background: colorOfName(actor ?? robot) }} aria-hidden /> {robot}
          </span>{" "}
          <StateLabel still tone={tone} word={words} />
        </Tabs.Tab>
      ))}
    </Tabs.List>
  );
}

/** The rest of each robot of a led run; a person who looked at one that cannot tell may say so. */
function RobotRests({ run }: { run: Run }) {
  const silent = new Set(silentRests(run).map(({ robot }) => robot));
  return (
    <RestList
      run={run}
      more={(robot) =>
        silent.has(robot) && <ConfirmRestButton key={run.id} run={run} robot={robot} />
      }
    />
  );
}

export function ShownRun(props: ShownRunProps) {
  const { run, going, graph, onChoose, folded, cursor, onSeek } = props;
  const { now } = useLive();
  const [tab, setTab] = useState(ALL_ROBOTS);
  const runs = going.length > 1 ? going : [run];
  const sent = useSentGraph(run)?.graph ?? null;
  const lanes = useLanes(run, graph, runs.length > 1 ? run.engine : "", sent);
  const tabs = robotTabs(runs, lanes, now.link !== "live", silentRobots(now));
  const shown = tabs.find(({ id }) => id === tab);
  const told = toldOf(run) === run.held?.why ? "" : spokenIn(run, toldOf(run));
  const goes = run.ended_at === null;
  const announces = goes && !SHOUTED.has(currentAlarm(run)?.code ?? "");
  const inLine = folded === true || told.length < SHORT;
  const choose = (value: string | null) => {
    setTab(value ?? ALL_ROBOTS);
    const wanted = tabs.find(({ id }) => id === value);
    if (wanted !== undefined && wanted.run.id !== run.id) onChoose(wanted.run.id);
  };
  const others = shown === undefined ? runs.filter(({ id }) => id !== run.id) : [];
  const actor = shown?.actor ?? null;
  const value = shown?.id ?? ALL_ROBOTS;
  const body = (
    <DrawerBody
      {...props}
      lanes={actor === null ? lanes : lanes.filter(({ robot }) => robot === actor)}
      others={others}
    />
  );
  return (
    <Tabs value={value} onChange={choose} keepMounted={false} className={style.whole ?? ""}>
      <RunHead
        {...props}
        told={inLine ? told : ""}
        announces={announces}
        cursor={cursor}
        onLive={() => onSeek(null)}
      />
      {folded !== true && <StartedWith run={run} />}
      {folded !== true && <Answers run={run} />}
      <RunQuestions run={run} />
      {cursor === null && <RunPoint run={run} graph={sent} id={props.point} />}
      <RobotRests run={run} />
      {!inLine && (
        <p
          className={style.told}
          role={announces ? "alert" : undefined}
          data-alarm={goes || undefined}
        >
          {told}
        </p>
      )}
      {tabs.length > 1 && <RobotTabList tabs={tabs} />}
      {folded !== true && tabs.length > 1 && (
        <Tabs.Panel value={value} className={style.panel ?? ""}>
          {body}
        </Tabs.Panel>
      )}
      {folded !== true && tabs.length < 2 && body}
    </Tabs>
  );
}

/** Since when nothing is heard of a run, ms. */
function useSilence(): (run: Run) => number | null {
  const { now } = useLive();
  return (run) => {
    if (run.ended_at !== null) return null;
    const engine = instant(run.unknown_since);
    if (now.link !== "down") return engine;
    const since = runTimeOf(run.id, now.since);
    return Math.min(engine ?? since, since);
  };
}

/** The latest of the actions that run; what is chosen comes first. */
function shownAction(run: Run, selected: string | null): string | null {
  if (selected !== null) return selected;
  const going = Object.values(run.actions ?? {}).filter(({ state }) => state === "RUNNING");
  const begun = (each: (typeof going)[number]) => each.visits.at(-1)?.from ?? "";
  return going.sort((a, b) => begun(b).localeCompare(begun(a)))[0]?.aid ?? null;
}

/** Return the same lanes for other runs of the graph; unchanged tracks stay the same objects. */
function useTracks(others: readonly Run[], graph: Graph, lanes: readonly Lane[]): Track[] {
  const silenceOf = useSilence();
  const engines = others.map(({ engine }) => engine).join("\n");
  const lanesBy = useMemo(() => {
    const actors = new Map(graph.actions.map((action) => [action.key, action.actor]));
    const outermost = new Map(lanes.map(({ name, aid }) => [name, aid]));
    const own = (engine: string) =>
      lanes.map((lane) => {
        const aid = outermost.get(lane.levels[0] ?? lane.name) ?? null;
        return { ...lane, robot: (aid !== null && actors.get(aid)) || engine };
      });
    return new Map(engines.split("\n").map((engine) => [engine, own(engine)]));
  }, [engines, graph, lanes]);
  return others.map((run) => ({
    run,
    silentSince: silenceOf(run),
    lanes: lanesBy.get(run.engine) ?? lanes,
  }));
}

interface DrawerBodyProps {
  run: Run;
  lanes: readonly Lane[];
  others: readonly Run[];
  graph: Graph;
  selected: string | null;
  onPick: (aid: string) => void;
  /** The moment of the run that the canvas shows, ms; null for the present. */
  cursor: number | null;
  onSeek: (at: number | null) => void;
}

export function DrawerBody(props: DrawerBodyProps) {
  const { run, lanes, others, graph, selected, onPick, cursor, onSeek } = props;
  const silenceOf = useSilence();
  const tracks = useTracks(others, graph, lanes);
  const pick = useCallback(({ aid }: Lane) => aid !== null && onPick(aid), [onPick]);
  return (
    <div className={style.body}>
      <Timeline
        run={run}
        lanes={lanes}
        silentSince={silenceOf(run)}
        others={tracks}
        selected={lanes.find(({ aid }) => aid !== null && aid === selected)?.name ?? null}
        onPick={pick}
        cursor={cursor}
        onSeek={onSeek}
        seeksByKeys
      />
      <ValuesPanel run={run} graph={graph} aid={shownAction(run, selected)} />
    </div>
  );
}

export const ALL_ROBOTS = "all";

export interface RobotTab {
  /** The run's id, or its id and the robot's name where one run has several robots. */
  readonly id: string;
  readonly robot: string;
  readonly run: Run;
  /** The robot whose actions these are; null: all of the run. */
  readonly actor: string | null;
  readonly tone: Tone;
  readonly words: string;
}

/**
 * Return what one robot of a run does, or the state of its run. `unheard`: the runner is not heard.
 */
function said(run: Run, names: ReadonlySet<string> | null, unheard: boolean) {
  if (run.ended_at === null && (unheard || run.state === "unknown" || run.state === "lost")) {
    return { tone: "unknown", words: "not known" } as const;
  }
  const own = Object.entries(run.actions ?? {}).filter(([name]) => names?.has(name) ?? true);
  const moving = movingActions({ ...run, actions: Object.fromEntries(own) });
  const [first, ...more] = moving;
  if (run.ended_at === null && run.state === "running" && first !== undefined) {
    return { tone: "run", words: more.length > 0 ? `${first} +${more.length}` : first } as const;
  }
  const { tone, word } = runLabel(run);
  if (names !== null && run.state === "running") return { tone: "idle", words: "waits" } as const;
  if (names === null || run.ended_at === null) return { tone, words: word };
  const last = lastVisit(own.map(([, action]) => action));
  if (last === null) {
    const isPassed = own.some(([, { state }]) => state === "BYPASSED");
    return { tone: "idle", words: isPassed ? "passed over" : "did not run" } as const;
  }
  if (visitEnd(last) === null) return { tone: "unknown", words: "end not seen" } as const;
  const ended = resultTone[last.result ?? ""];
  return ended === undefined ? { tone, words: word } : { tone: ended, words: ended };
}

/** Return the visit of these actions that ended last, or that was not seen to end; null if none began. */
function lastVisit(actions: readonly ActionRun[]): Visit | null {
  const end = (visit: Visit) => visitEnd(visit) ?? Number.POSITIVE_INFINITY;
  const visits = actions.flatMap((action) => action.visits);
  return visits.reduce<Visit | null>(
    (last, visit) => (last === null || end(visit) >= end(last) ? visit : last),
    null,
  );
}

/** Words for the rest of a robot in its tab; the lines above say more. */
const AT_REST: Partial<Record<RobotRest["state"], string>> = {
  seen: "seen at rest",
  unused: "nothing begun",
  unsent: "nothing begun",
};

/**
 * A tab for each run that goes on; of a single run, for each of the robots in it. `silent`: robots
 * that do not answer, whose part of a led run is not known.
 */
export function robotTabs(
  runs: readonly Run[],
  lanes: readonly Lane[],
  unheard: boolean,
  silent: ReadonlySet<string> = new Set(),
): RobotTab[] {
  const [only] = runs;
  const actors = robotsOf(lanes);
  if (runs.length === 1 && only !== undefined && actors.length > 1) {
    return actors.map((actor) => {
      const names = new Set(lanes.filter(({ robot }) => robot === actor).map(({ name }) => name));
      const robot = performerWords(actor);
      const unknown = unheard || (Boolean(only.robots) && silent.has(actor));
      const stops = !unheard && only.desired === "stopped" && !only.ended_at;
      const rest = stops ? knownRest(only, actor) : null;
      const words = rest
        ? { tone: restWords(rest, only).tone, words: AT_REST[rest.state] ?? "at rest" }
        : said(only, names, unknown);
      return { id: `${only.id} ${actor}`, robot, run: only, actor, ...words };
    });
  }
  const tabs = runs.map((run) => ({
    id: run.id,
    robot: run.simulated ? "simulator" : enginesOf(run).join(", "),
    run,
    actor: null,
    ...said(run, null, unheard),
  }));
  return tabs.sort((a, b) => a.robot.localeCompare(b.robot) || a.run.number - b.run.number);
}

export function allWords(tabs: readonly RobotTab[]): string {
  if (tabs.some(({ actor }) => actor !== null && !isRobot(actor))) return "All";
  return tabs.length === 2 ? "Both robots" : `All ${tabs.length} robots`;
}
