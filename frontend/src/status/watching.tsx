/** Asks who watches the robots whose owners want to know it: one tick for each, before anything sets them going. */
import { Checkbox } from "@mantine/core";
import { useState } from "react";
import { enginesOf } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { SIMULATOR } from "../api/robots";
import type { Run } from "../api/runs";
import { isolated } from "../words/isolated";
import style from "./watching.module.css";

export interface Watch {
  /** Robots of which somebody has to say that they watch them. */
  readonly asked: readonly string[];
  /** The words of the person, in the form that the runner takes. */
  readonly watching: Readonly<Record<string, true>>;
  /** The reason why nothing may be set going yet; null when all is said. */
  readonly obstacle: string | null;
  readonly toggle: (robot: string) => void;
  /** Forgets what was said: it counts for one start, resume or change. */
  readonly forget: () => void;
}

/** Remember which of these robots a person says to watch, until that is used or the asking part is closed. */
export function useWatching(robots: readonly string[]): Watch {
  const { now } = useLive();
  const [said, setSaid] = useState<readonly string[]>([]);
  const asked = now.engines
    .filter(({ name, watched }) => watched && robots.includes(name))
    .map(({ name }) => name);
  // Of a robot that was left out meanwhile it is asked anew.
  const current = said.filter((robot) => asked.includes(robot));
  if (current.length < said.length) setSaid(current);
  const missing = asked.find((robot) => !said.includes(robot));
  return {
    asked,
    watching: Object.fromEntries(
      asked.filter((robot) => said.includes(robot)).map((robot) => [robot, true as const]),
    ),
    obstacle: missing === undefined ? null : `Say that you watch ${isolated(missing)}`,
    toggle: (robot) =>
      setSaid(said.includes(robot) ? said.filter((each) => each !== robot) : [...said, robot]),
    forget: () => setSaid([]),
  };
}

export const NOTHING_MOVES = "Only the simulator plays: nothing moves.";

/** Return the robots that carry out a run. */
export function robotsOfRun(run: Run): string[] {
  return enginesOf(run).filter((engine) => engine !== SIMULATOR);
}

/** Return which of the robots of a run may begin to move, as a sentence. */
export function movesWords(run: Run): string {
  const players = robotsOfRun(run).map(isolated).join(", ");
  return players === "" ? NOTHING_MOVES : `${players} may begin to move.`;
}

export function WatchTicks({ watch }: { watch: Watch }) {
  if (watch.asked.length === 0) return null;
  return (
    <fieldset className={style.ticks}>
      <legend>Who watches</legend>
      {watch.asked.map((robot) => (
        <Checkbox
          key={robot}
          checked={watch.watching[robot] === true}
          onChange={() => watch.toggle(robot)}
          label={`I watch ${isolated(robot)}, and its hardware stop is within my reach`}
        />
      ))}
    </fieldset>
  );
}
