/** The head of the drawer: which run, how it stands, and what can be done with it. */

import { ActionIcon, Button, Text } from "@mantine/core";
import { IconChartBar, IconChevronDown, IconChevronUp, IconHistory } from "@tabler/icons-react";
import { Link } from "wouter";
import { useLive } from "../../api/live/use-live";
import { useCurrentName } from "../../api/people";
import type { Run } from "../../api/runs";
import { serverTimeOf } from "../../clock/server-clock";
import { boundsText } from "../../status/durations";
import { useRunStatus } from "../../status/run-status";
import { StateLabel } from "../../status/state-label";
import { colorOfName } from "../../ui/name-colors";
import { clock, day, instant, stopwatch, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import { PauseButton } from "../pause-button";
import { ConfirmRestButton } from "../stop/confirm-rest-button";
import style from "./run-drawer.module.css";

interface Props {
  run: Run;
  versionLabel: string;
  /** What fits beside the rest; empty where it does not, or there is nothing. */
  told: string;
  announces: boolean;
  /** The canvas shows the run as it was at an earlier moment, ms. */
  cursor: number | null;
  onLive: () => void;
  /** Null: it cannot be folded. */
  folded: boolean | null;
  onFold: (folded: boolean) => void;
}

function FoldButton({ folded, onFold }: { folded: boolean; onFold: Props["onFold"] }) {
  const Sign = folded ? IconChevronUp : IconChevronDown;
  return (
    <ActionIcon
      size={24}
      aria-label={folded ? "Show the lanes" : "Hide the lanes"}
      aria-expanded={!folded}
      onClick={() => onFold(!folded)}
    >
      <Sign size={16} aria-hidden />
    </ActionIcon>
  );
}

/** Who started it, when, and how long it took or has been going on. */
function Origin({ run, until }: { run: Run; until: number | null }) {
  const by = useCurrentName(run.author);
  const goes = run.ended_at === null;
  const present = useNow(1000, goes && until === null);
  const start = instant(run.started_at) ?? present;
  const when = day(start, present);
  const started = when === "today" ? `at ${clock(start)}` : `${when} ${clock(start)}`;
  const took = goes
    ? stopwatch((until ?? present) - start)
    : (boundsText(run.took) ?? stopwatch((instant(run.ended_at) ?? present) - start));
  return (
    <Text span c="dimmed" size="xs" truncate>
      {run.simulated && "simulated · "}
      started by {isolated(by)} {started} · {took}
    </Text>
  );
}

/** Where one can go from here. */
function Ways({ run }: { run: Run }) {
  return (
    <>
      {run.graph !== null && (
        <Button
          component={Link}
          to={`/runs/statistics?graph=${encodeURIComponent(run.graph)}`}
          size="compact-xs"
          variant="subtle"
          color="gray"
          flex="none"
          leftSection={<IconChartBar size={14} aria-hidden />}
        >
          Statistics
        </Button>
      )}
      <Button
        component={Link}
        to={`/runs/${run.id}`}
        size="compact-xs"
        variant="subtle"
        flex="none"
      >
        Open run
      </Button>
    </>
  );
}

export function RunHead(props: Props) {
  const { run, versionLabel, told, announces, cursor, onLive, folded, onFold } = props;
  const { now } = useLive();
  const goes = run.ended_at === null;
  const unsure = now.link === "down" && goes;
  return (
    <header className={style.head}>
      <b>Run {run.number}</b>
      {!run.simulated && (
        <span className={style.robot}>
          <i style={{ background: colorOfName(run.engine) }} aria-hidden /> {run.engine}
        </span>
      )}
      <span className={style.version}>{versionLabel}</span>
      <StateLabel pill still {...useRunStatus(run)} />
      <Origin run={run} until={unsure ? serverTimeOf(now.since) : null} />
      <span className={style.gap} />
      {told !== "" && (
        <span className={style.alarm} role={announces ? "alert" : undefined} title={told}>
          {told}
        </span>
      )}
      {!run.recorded && <span className={style.alarm}>not recorded</span>}
      <span className={style.buttons}>
        {cursor !== null && (
          <Button
            size="compact-xs"
            variant="light"
            leftSection={<IconHistory size={14} aria-hidden />}
            onClick={onLive}
          >
            {goes ? "Back to live" : "Back to its end"}
          </Button>
        )}
        {goes && <ConfirmRestButton key={run.id} run={run} />}
        {goes && <PauseButton run={run} />}
        <Ways run={run} />
        {folded !== null && <FoldButton folded={folded} onFold={onFold} />}
      </span>
    </header>
  );
}
