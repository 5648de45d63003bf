/** The strip under the canvas: the newest run of the graph as it goes. */
import { ActionIcon, Button, Text } from "@mantine/core";
import { IconChevronDown, IconChevronUp, IconTimeline } from "@tabler/icons-react";
import { useMemo } from "react";
import { Link } from "wouter";
import { authorName } from "../api/graphs";
import { endWords, runWord } from "../api/progress";
import type { Run } from "../api/runs";
import { useLive } from "../api/use-live";
import type { Graph } from "../graph/model";
import { lanesOf } from "../ui/lanes";
import { StateWord } from "../ui/state-word";
import { Timeline } from "../ui/timeline";
import { spanWords } from "../ui/took";
import { clock, day, instant, stopwatch, useNow } from "../ui/when";
import { PauseButton } from "./pause-button";
import { RestButton } from "./rest-button";
import style from "./run-strip.module.css";

interface Props {
  /** Undefined until it is known. */
  run: Run | null | undefined;
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

export function RunStrip({ run, graph, versionLabel, selected, onPick, folded, onFold }: Props) {
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
  const start = instant(run.started_at) ?? present;
  const until = down ? now.since : present;
  const when = day(start, present);
  const started = when === "today" ? `at ${clock(start)}` : `${when} ${clock(start)}`;
  const { tone, word } = runWord(run);
  const alarm = run.alarms.at(-1);
  const unsure = down && goes;
  const silent = goes ? instant(run.unknown_since) : null;
  return (
    <section
      className={style.strip}
      data-low={folded === true || undefined}
      data-alone={folded === null || undefined}
      aria-label="Run"
    >
      <header className={style.head}>
        <b>Run {run.number}</b>
        <span className={style.version}>{versionLabel}</span>
        <StateWord
          pill
          tone={unsure ? "unknown" : tone}
          word={unsure ? `unknown since ${clock(now.since)}` : goes ? word : endWords(run)}
        />
        <Text span c="dimmed" size="xs" truncate>
          {run.simulated && "simulated · "}
          started by {authorName(run.author)} {started} ·{" "}
          {(!goes && spanWords(run.took)) || stopwatch((instant(run.ended_at) ?? until) - start)}
        </Text>
        <span className={style.gap} />
        {alarm && <span className={style.alarm}>{alarm.text}</span>}
        {!run.recorded && <span className={style.alarm}>not recorded</span>}
        {run.ended_at !== null && run.detail !== "" && (
          <Text span size="xs" truncate title={run.detail}>
            {run.detail}
          </Text>
        )}
        {goes && <RestButton run={run} />}
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
