/** Which robots have a tab in the drawer of a run, and what each says. Pure. */
import type { Run } from "../../api/runs";
import { type Lane, robotsOf } from "../../status/lanes/lanes";
import { runLabel, type Tone } from "../../status/progress";
import { movingActions } from "../moves-now";

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

/** What one robot of a run does, or how its run stands. `unheard`: nothing is heard of any run. */
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
  return { tone, words: word };
}

/** A tab for each run that goes on; of a single run, for each of the robots in it. */
export function robotTabs(
  runs: readonly Run[],
  lanes: readonly Lane[],
  unheard: boolean,
): RobotTab[] {
  const [only] = runs;
  const actors = robotsOf(lanes);
  if (runs.length === 1 && only !== undefined && actors.length > 1) {
    return actors.map((actor) => {
      const names = new Set(lanes.filter(({ robot }) => robot === actor).map(({ name }) => name));
      const robot = actor === "" ? "any robot" : actor;
      return { id: `${only.id} ${actor}`, robot, run: only, actor, ...said(only, names, unheard) };
    });
  }
  const tabs = runs.map((run) => ({
    id: run.id,
    robot: run.simulated ? "simulator" : run.engine,
    run,
    actor: null,
    ...said(run, null, unheard),
  }));
  return tabs.sort((a, b) => a.robot.localeCompare(b.robot) || a.run.number - b.run.number);
}

export function allWords(tabs: readonly RobotTab[]): string {
  return tabs.length === 2 ? "Both robots" : `All ${tabs.length} robots`;
}
