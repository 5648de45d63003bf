/** The strip under the canvas: the newest run of the graph as it goes. */
import { ActionIcon, Button, Text } from "@mantine/core";
import { IconChevronDown, IconChevronUp, IconTimeline } from "@tabler/icons-react";
import { useMemo } from "react";
import { Link } from "wouter";
import { authorName } from "../api/graphs";
import { useLive } from "../api/live/use-live";
import { currentAlarm, type Run } from "../api/runs";
import type { Graph } from "../graph/model";
import { boundsText } from "../status/durations";
import { runEndText, runLabel } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { Timeline } from "../status/timeline";
import { lanesOf } from "../status/timeline-lanes";
import { colorOfName } from "../ui/name-colors";
import { clock, day, instant, stopwatch, useNow } from "../ui/times";
import { PauseButton } from "./pause-button";
import style from "./run-strip.module.css";
import { ConfirmRestButton } from "./stop/confirm-rest-button";

/** What the notice shouts on every page already. */
const SHOUTED: ReadonlySet<string> = new Set(["stop_unconfirmed", "moves_again"]);

interface Props {
  /** Undefined until it is known. */
  run: Run | null | undefined;
  /** All runs of this graph that go on; where there are several, one is chosen. */
  going: readonly Run[];
  onChoose: (run: string) => void;
  graph: Graph;
  versionLabel: string;
  selected: string | null;
  onPick: (aid: string) => void;
  /** Only the head is shown; null: it cannot be folded. */
  folded: boolean | null;
  onFold: (folded: boolean) => void;
}

function FoldButton({ folded, onFold }: { folded: boolean; onFold: (folded: boolean) => void }) {
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

/** Whose run it is; where several go on, which of them is shown. */
function Whose({ run, going, onChoose }: Pick<Props, "going" | "onChoose"> & { run: Run }) {
  const others = going.some((each) => each.id !== run.id);
  if (!others) return run.simulated ? null : <Robot name={run.engine} />;
  const all = going.some((each) => each.id === run.id) ? going : [run, ...going];
  return (
    <fieldset className={style.whose}>
      <legend className="visually-hidden">Runs of this graph that go on</legend>
      {all.map((each) => (
        <button
          key={each.id}
          type="button"
          aria-pressed={each.id === run.id}
          aria-label={`Run ${each.number} on ${each.engine}, ${runLabel(each).word}`}
          onClick={() => onChoose(each.id)}
        >
          <Robot name={each.engine} />
        </button>
      ))}
    </fieldset>
  );
}

function Robot({ name }: { name: string }) {
  return (
    <span className={style.robot}>
      <i style={{ background: colorOfName(name) }} aria-hidden /> {name}
    </span>
  );
}

const SHORT = 60; // characters that fit beside the rest

/** What a person must know of it now, or why it ended so. */
function toldOf(run: Run): string {
  const alarm = currentAlarm(run)?.text ?? "";
  return run.ended_at === null ? alarm : run.detail || alarm;
}

interface HeadProps extends Props {
  run: Run;
  present: number;
  /** What fits beside the rest; empty where it does not, or there is nothing. */
  told: string;
  announces: boolean;
}

/** The run in one line, with what can be done with it. */
function Head(props: HeadProps) {
  const { run, present, told, announces, going, versionLabel, onChoose, folded, onFold } = props;
  const { now } = useLive();
  const goes = run.ended_at === null;
  const down = now.link === "down";
  const unsure = down && goes;
  const until = down ? now.since : present;
  const start = instant(run.started_at) ?? present;
  const when = day(start, present);
  const started = when === "today" ? `at ${clock(start)}` : `${when} ${clock(start)}`;
  const { tone, word } = runLabel(run);
  return (
    <header className={style.head}>
      <b>Run {run.number}</b>
      <Whose run={run} going={going} onChoose={onChoose} />
      <span className={style.version}>{versionLabel}</span>
      <StateLabel
        pill
        tone={unsure ? "unknown" : tone}
        word={unsure ? `unknown since ${clock(now.since)}` : goes ? word : runEndText(run)}
      />
      <Text span c="dimmed" size="xs" truncate>
        {run.simulated && "simulated · "}
        started by {authorName(run.author)} {started} ·{" "}
        {(!goes && boundsText(run.took)) || stopwatch((instant(run.ended_at) ?? until) - start)}
      </Text>
      <span className={style.gap} />
      {told !== "" && (
        <span className={style.alarm} role={announces ? "alert" : undefined} title={told}>
          {told}
        </span>
      )}
      {goes && <ConfirmRestButton run={run} />}
      {!run.recorded && <span className={style.alarm}>not recorded</span>}
      {goes && <PauseButton run={run} />}
      <Button
        component={Link}
        to={`/runs/${run.id}`}
        size="compact-xs"
        variant="subtle"
        flex="none"
      >
        Open run
      </Button>
      {folded !== null && <FoldButton folded={folded} onFold={onFold} />}
    </header>
  );
}

export function RunStrip(props: Props) {
  const { run, graph, selected, onPick, folded } = props;
  const { now } = useLive();
  const goes = run?.ended_at === null;
  const present = useNow(250, goes);
  const lanes = useMemo(() => (run ? lanesOf(run, graph) : []), [run, graph]);
  if (run === undefined)
    return <section className={style.strip} data-low aria-busy="true" aria-label="Run" />;
  if (run === null) {
    return (
      <section className={style.strip} data-low aria-label="Run">
        <div className={style.none}>
          <IconTimeline size={18} aria-hidden />
          <span>
            Not run yet. Hold <b>Start</b> and every action appears here as a lane, while it runs.
          </span>
        </div>
      </section>
    );
  }
  const down = now.link === "down";
  const until = down ? now.since : present;
  const told = toldOf(run);
  const announces = goes && !SHOUTED.has(currentAlarm(run)?.code ?? "");
  const inLine = folded === true || told.length < SHORT;
  const unsure = down && goes;
  const silent = goes ? instant(run.unknown_since) : null;
  return (
    <section
      className={style.strip}
      data-low={folded === true || undefined}
      data-alone={folded === null || undefined}
      aria-label="Run"
    >
      <Head
        {...props}
        run={run}
        present={present}
        told={inLine ? told : ""}
        announces={announces}
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
      {folded !== true && (
        <Timeline
          run={run}
          lanes={lanes}
          until={until}
          unsure={unsure}
          gaps={silent === null ? [] : [{ from: silent, until, text: "No answer of the engine" }]}
          selected={selected}
          onPick={onPick}
        />
      )}
    </section>
  );
}
