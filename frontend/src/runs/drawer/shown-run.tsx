/** A run in the drawer: its head, a tab for each robot, and what they show while it is open. */
import { Tabs } from "@mantine/core";
import { useState } from "react";
import { useLive } from "../../api/live/use-live";
import { currentAlarm, type Run } from "../../api/runs";
import type { Graph } from "../../graph/model";
import { useLanes } from "../../status/lanes/lanes";
import { StateLabel } from "../../status/state-label";
import { colorOfName } from "../../ui/name-colors";
import { DrawerBody } from "./drawer-body";
import { ALL_ROBOTS, allWords, type RobotTab, robotTabs } from "./robot-tabs";
import style from "./run-drawer.module.css";
import { RunHead } from "./run-head";

/** What the notice shouts on every page already. */
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
  onPick: (aid: string) => void;
  /** Where the canvas shows the run, ms; null: as it is now. */
  cursor: number | null;
  onSeek: (at: number | null) => void;
  /** Only the head is shown; null: it cannot be folded. */
  folded: boolean | null;
  onFold: (folded: boolean) => void;
}

/** What a person must know of it now, or why it ended so. */
function toldOf(run: Run): string {
  const alarm = currentAlarm(run)?.text ?? "";
  return run.ended_at === null ? alarm : run.detail || alarm;
}

function RobotTabList({ tabs }: { tabs: readonly RobotTab[] }) {
  return (
    <Tabs.List className={style.tabs ?? ""} aria-label="Robots that run this graph">
      <Tabs.Tab value={ALL_ROBOTS}>{allWords(tabs)}</Tabs.Tab>
      {tabs.map(({ id, robot, tone, words }) => (
        <Tabs.Tab key={id} value={id}>
          <span className={style.robot}>
            <i style={{ background: colorOfName(robot) }} aria-hidden /> {robot}
          </span>{" "}
          <StateLabel still tone={tone} word={words} />
        </Tabs.Tab>
      ))}
    </Tabs.List>
  );
}

export function ShownRun(props: ShownRunProps) {
  const { run, going, graph, onChoose, folded, cursor, onSeek } = props;
  const { now } = useLive();
  const [tab, setTab] = useState(ALL_ROBOTS);
  const runs = going.length > 1 ? going : [run];
  const lanes = useLanes(run, graph, runs.length > 1 ? run.engine : "");
  const tabs = robotTabs(runs, lanes, now.link !== "live");
  const shown = tabs.find(({ id }) => id === tab);
  const told = toldOf(run);
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
