/** What the drawer shows while it is open: lanes over time, values at the right. */

import { useCallback, useMemo } from "react";
import { useLive } from "../../api/live/use-live";
import type { Run } from "../../api/runs";
import { serverTimeOf } from "../../clock/server-clock";
import type { Graph } from "../../graph/model";
import type { Lane } from "../../status/lanes/lanes";
import { Timeline, type Track } from "../../status/lanes/timeline";
import { instant } from "../../ui/times";
import style from "./run-drawer.module.css";
import { ValuesPanel } from "./values-panel";

/** Since when nothing is heard of a run, ms. */
function useSilence(): (run: Run) => number | null {
  const { now } = useLive();
  return (run) => {
    if (run.ended_at !== null) return null;
    const engine = instant(run.unknown_since);
    if (now.link !== "down") return engine;
    const since = serverTimeOf(now.since);
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

/** The same lanes for other runs of the graph; the same objects while nothing about them changes. */
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

interface Props {
  run: Run;
  lanes: readonly Lane[];
  others: readonly Run[];
  graph: Graph;
  selected: string | null;
  onPick: (aid: string) => void;
  /** Where the canvas shows the run, ms; null: as it is now. */
  cursor: number | null;
  onSeek: (at: number | null) => void;
}

export function DrawerBody(props: Props) {
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
