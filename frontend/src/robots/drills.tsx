/** Stop drills of a robot: those that were made, and to say what was seen in one. */
import { Button } from "@mantine/core";
import { IconAlertTriangle, IconCheck, IconHandStop } from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import { useMay } from "../api/people";
import type { Drill, Robot } from "../api/robots";
import { serverNow } from "../clock/server-clock";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { clock, day, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./drills.module.css";

const DrillForm = lazyPart(() => import("./drill-form").then((part) => part.DrillForm));
const SHOWN = 3;

/** Return how a drill went, in words. */
export function drillWords({ proof_ms, failure }: Drill): string {
  if (failure !== "") return `failed: ${failure}`;
  return `passed: rest proven after ${((proof_ms ?? 0) / 1000).toFixed(2)} s`;
}

function Line({ drill }: { drill: Drill }) {
  const at = instant(drill.stopped_at) ?? 0;
  const Sign = drill.failure === "" ? IconCheck : IconAlertTriangle;
  return (
    <li data-failed={drill.failure !== "" || undefined}>
      <Sign size={14} aria-hidden />
      <span>
        <time dateTime={drill.stopped_at}>{`${day(at, serverNow())} ${clock(at)}`}</time>,{" "}
        {isolated(drill.by.name || "somebody")},{" "}
        <Link to={`/runs/${drill.run}`}>run {drill.number}</Link>: {drillWords(drill)}
      </span>
    </li>
  );
}

/** The drills of a robot, where one was made or its owner asks for them. */
export function Drills({ robot }: { robot: Robot }) {
  const may = useMay("operate");
  const [asks, setAsks] = useState(false);
  if (robot.drills.length === 0 && robot.drill_days === null) return null;
  return (
    <section className={style.drills} aria-label={`Stop drills of ${isolated(robot.name)}`}>
      <header>
        <IconHandStop size={15} aria-hidden />
        <span>
          Stop drills
          {robot.drill_days !== null && `, one within ${robot.drill_days} days`}
        </span>
        {may && (
          <Button size="compact-sm" onClick={() => setAsks(true)}>
            Record a Stop drill …
          </Button>
        )}
      </header>
      <ul className="list-reset">
        {robot.drills.slice(0, SHOWN).map((drill) => (
          <Line key={`${drill.run} ${drill.failure}`} drill={drill} />
        ))}
      </ul>
      <OverlayBoundary>
        {asks && <DrillForm robot={robot} onClose={() => setAsks(false)} />}
      </OverlayBoundary>
    </section>
  );
}
