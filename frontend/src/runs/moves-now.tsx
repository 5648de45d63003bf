/** One line in the bar of every page: what moves now, on which robot. */
import { IconQuestionMark } from "@tabler/icons-react";
import { useMemo } from "react";
import { Link } from "wouter";
import { enginesOf } from "../api/led-runs";
import { foreignGraphs, type LiveState, openRuns, silentRobots } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { SIMULATOR } from "../api/robots";
import type { Run } from "../api/runs";
import { actionWords, placesOf } from "../status/level-places";
import { knownRest, restWords } from "../status/rests";
import { colorOfName } from "../ui/name-colors";
import { instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./moves-now.module.css";

const MOST = 3; // robots; the rest are counted

function One({ moving }: { moving: Moving }) {
  const inside = (
    <>
      {moving.kind === "unknown" ? (
        <IconQuestionMark size={12} stroke={2.6} aria-hidden />
      ) : (
        <i style={{ background: colorOfName(moving.robot) }} aria-hidden />
      )}
      <b>{moving.robot}</b> <span className={style.words}>{moving.words}</span>
    </>
  );
  const shared = { className: style.one, "data-kind": moving.kind };
  return moving.run === null ? (
    <span {...shared}>{inside}</span>
  ) : (
    <Link to={`/runs/${moving.run}`} {...shared}>
      {inside}
    </Link>
  );
}

export function MovesNowLine() {
  const { now } = useLive();
  const moving = useMemo(() => movesNow(now), [now]);
  if (moving.length === 0) return null;
  const all = moving.map(({ robot, words }) => `${isolated(robot)}: ${words}`).join(" · ");
  return (
    <section className={style.line} aria-label="Moves now" title={all}>
      <span className={style.head} aria-hidden>
        Moves now
      </span>
      {moving.slice(0, MOST).map((each) => (
        <One key={`${each.robot} ${each.run ?? each.words}`} moving={each} />
      ))}
      {moving.length > MOST && <span>and {moving.length - MOST} more</span>}
    </section>
  );
}

export interface Moving {
  readonly robot: string;
  /** `moves`: seen; `still`: heard of, and nothing was seen to move; `unknown`: nobody knows. */
  readonly kind: "moves" | "still" | "unknown";
  readonly words: string;
  /** The run of it; null for what nobody started from here. */
  readonly run: string | null;
}

const MOVE: ReadonlySet<string> = new Set(["RUNNING", "STOPPING", "PAUSE_REQUESTED"]);

/**
 * The actions of a run that were seen to move, in words, with what was not seen marked. Where something moves inside
 * of an action, that is told, with the way to it, and not the action around it once more.
 */
export function movingActions(run: Run): string[] {
  const moving = Object.entries(run.actions ?? {}).filter(([, action]) => MOVE.has(action.state));
  const places = placesOf(run);
  const around = new Set(
    moving.flatMap(([name]) => {
      const levels = places.get(name)?.levels ?? [];
      return levels.map((_, n) => levels.slice(0, n + 1).join("/"));
    }),
  );
  return moving
    .filter(([name]) => {
      const place = places.get(name);
      return !place || !around.has([...place.levels, place.name].join("/"));
    })
    .map(([name, action]) => {
      const words = actionWords(run, name);
      return action.visits.at(-1)?.how === "inferred" ? `${words} (inferred)` : words;
    });
}

const AT_NO_WORD: Partial<Record<Run["state"], string>> = {
  paused: "paused",
  requested: "asked to start",
  published: "starting",
  stopping: "stopping, rest not proven",
};

function ofRobot(run: Run, robot: string, silent = false): Moving {
  const base = { robot, run: run.id };
  if (
    silent ||
    run.state === "unknown" ||
    run.state === "lost" ||
    instant(run.unknown_since) !== null
  ) {
    return { ...base, kind: "unknown", words: "not known" };
  }
  if (run.hidden) {
    const words = AT_NO_WORD[run.state] ?? run.graph_name;
    return { ...base, kind: "unknown", words };
  }
  const names = movingActions(run);
  if (names.length > 0) return { ...base, kind: "moves", words: names.join(", ") };
  const waits = run.robots ? "waits" : "no action seen to run";
  const words = AT_NO_WORD[run.state] ?? waits;
  return { ...base, kind: run.state === "stopping" ? "unknown" : "still", words };
}

/** Return what moves on each robot of a run; actions of a led run without a robot are simulated. */
function ofRun(run: Run, silent: ReadonlySet<string>): Moving[] {
  if (!run.robots) return [ofRobot(run, run.engine)];
  const all = Object.entries(run.actions ?? {});
  return enginesOf(run).map((robot) => {
    const own = all.filter(([, action]) => (action.robot || SIMULATOR) === robot);
    const rest = run.desired === "stopped" ? knownRest(run, robot) : null;
    if (rest) return { robot, run: run.id, kind: "still", words: restWords(rest, run).words };
    return ofRobot({ ...run, actions: Object.fromEntries(own) }, robot, silent.has(robot));
  });
}

/** In the simulator nothing moves; a led run there says for what it waits. */
const isToTell = (run: Run) => !run.simulated || Boolean(run.robots);

/** Return what moves now, sorted by robot. While the runner is not heard, that is unknown for each of them. */
export function movesNow(now: LiveState): Moving[] {
  const silent = silentRobots(now);
  const runs = openRuns(now)
    .filter(isToTell)
    .flatMap((run) => ofRun(run, silent));
  const foreign = foreignGraphs(now).map(({ robot, held }): Moving => {
    const base = { robot: robot.name, run: null };
    if (silent.has(robot.name))
      return {
        ...base,
        kind: "unknown",
        words: `not known, ran ${isolated(held.graph)} when it last answered`,
      };
    return { ...base, kind: "moves", words: `${isolated(held.graph)}, not started here` };
  });
  const all = [...runs, ...foreign].sort((a, b) => a.robot.localeCompare(b.robot));
  if (now.link === "live") return all;
  return all.map((each) => ({ ...each, kind: "unknown", words: "not known" }));
}
