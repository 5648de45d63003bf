/** One line in the bar of every page: what moves now, on which robot. */
import { IconQuestionMark } from "@tabler/icons-react";
import { useMemo } from "react";
import { Link } from "wouter";
import { useLive } from "../api/live/use-live";
import { colorOfName } from "../ui/name-colors";
import { isolated } from "../words/isolated";
import { type Moving, movesNow } from "./moves-now";
import style from "./moves-now-line.module.css";

const MOST = 3; // robots; the rest are counted

function One({ moving }: { moving: Moving }) {
  const inside = (
    <>
      {moving.kind === "unknown" ? (
        <IconQuestionMark size={12} stroke={2.6} aria-hidden />
      ) : (
        <i style={{ background: colorOfName(moving.robot) }} aria-hidden />
      )}
      <b>{moving.robot}</b> {moving.words}
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
