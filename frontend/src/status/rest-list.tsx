/** A line for each robot of a led run: how far its rest is proven. */
import type { ReactNode } from "react";
import { useLive } from "../api/page-link";
import type { Run } from "../api/run-stop";
import { colorOfName } from "../ui/name-colors";
import style from "./rest-list.module.css";
import { restLines } from "./rests";
import { StateLabel } from "./state-label";

export function RestList({ run, more }: { run: Run; more?: (robot: string) => ReactNode }) {
  const { now } = useLive(run.id);
  const lines = restLines(run, now.link === "down");
  if (lines.length === 0) return null;
  return (
    <ul className={style.list} aria-label="Rest of each robot">
      {lines.map(({ robot, tone, words }) => (
        <li key={robot} data-robot-rest={robot}>
          <i style={{ background: colorOfName(robot) }} aria-hidden />
          <bdi className="weight-600">{robot}</bdi>
          <StateLabel still tone={tone} word={words} />
          {more?.(robot)}
        </li>
      ))}
    </ul>
  );
}
