/** Two runs on one time axis: this run filled, the other one as a ghost beneath, and where they part. */
import { type CSSProperties, useMemo, useState } from "react";
import type { ComparedStep, Comparison } from "../api/review";
import type { Run, Visit } from "../api/runs";
import { spokenName } from "../graph/spoken-name";
import { barOf, shareOf, type TimeAxis, ticksOf, wholeSpan } from "../status/lanes/axis";
import { AllLevels, LaneToggle, type OpenLanes, useOpenLanes } from "../status/lanes/lane-row";
import { openLanes } from "../status/lanes/lanes";
import { wayWords } from "../status/level-places";
import { visitBegin, visitEnd } from "../status/progress";
import { toneColor } from "../status/state-label";
import { Segments } from "../ui/segments";
import { duration, instant } from "../ui/times";
import { type ComparedAction, comparedActions, rangeText } from "./differences";
import style from "./ghost-lanes.module.css";

type Alignment = "start" | "parting";

/**
 * Return the zero point of each run: its start, or the time that puts the first difference of both
 * at the same place.
 */
function beginnings(a: Run, b: Run, parting: ComparedStep | null, by: Alignment) {
  const [startA, startB] = [instant(a.started_at) ?? 0, instant(b.started_at) ?? 0];
  const [from, to] = [parting?.a, parting?.b];
  const [at, bt] = [from ? visitBegin(from) : null, to ? visitBegin(to) : null];
  if (by === "start" || at === null || bt === null) return { a: startA, b: startB };
  const lead = Math.max(at - startA, bt - startB);
  return { a: at - lead, b: bt - lead };
}

/**
 * Return when the runs differ first, ms: the end or begin of that step in the second run, else in
 * the first.
 */
function partingAt(step: ComparedStep | null, begun: { a: number; b: number }): number | null {
  const visit = step?.b ?? step?.a;
  if (!step || !visit) return null;
  const at = visitEnd(visit) ?? visitBegin(visit);
  return at === null ? null : at - (step.b ? begun.b : begun.a);
}

const percent = (share: number) => `${share * 100}%`;

function GhostBar({ visit, axis, ghost }: { visit: Visit; axis: TimeAxis; ghost: boolean }) {
  const bar = barOf(visit, axis, axis.start + axis.span, true);
  if (bar === null) return null;
  const { sure, maybe, tone } = bar;
  const color = toneColor[tone];
  return (
    <>
      {maybe && (
        <i
          className={style.maybe}
          data-ghost={ghost || undefined}
          style={{ left: percent(maybe.left), width: percent(maybe.width), color }}
        />
      )}
      {sure && (
        <i
          data-ghost={ghost || undefined}
          data-tone={tone}
          style={{ left: percent(sure.left), width: percent(sure.width), color }}
        />
      )}
    </>
  );
}

interface LaneProps {
  action: ComparedAction;
  axes: { a: TimeAxis; b: TimeAxis };
  steps: readonly ComparedStep[];
  parts: boolean;
  selected: boolean;
  onPick: (aid: string | null) => void;
  /** Null where no action has others inside. */
  inside: OpenLanes | null;
}

/** Its name, with what opens the lanes inside of it. */
function GhostName({ action, parts, onPick, inside }: Omit<LaneProps, "steps" | "axes">) {
  const { aid, levels, label, name, holds } = action;
  const words = wayWords({ levels, name: label });
  const opened = holds && inside !== null ? inside.open.has(name) : null;
  return (
    <span
      className="row min-w-0"
      style={{ paddingLeft: `${Math.min(6, levels.length) * 0.75}rem` }}
    >
      {inside !== null && (
        <LaneToggle words={words} opened={opened} onOpen={() => inside.toggle(name)} />
      )}
      <button
        type="button"
        disabled={aid === null}
        title={words}
        aria-label={levels.length > 0 ? words : undefined}
        onClick={() => onPick(aid)}
      >
        {parts && <b className={style.mark}>1</b>}
        <bdi>{spokenName(label)}</bdi>
      </button>
    </span>
  );
}

function GhostLane(props: LaneProps) {
  const { action, axes, steps, parts, selected } = props;
  const own = steps.filter((step) => step.action === action.name);
  const words = (side: "a" | "b") => {
    const found = action[side];
    if (found === null) return "did not run";
    const often = found.results.length > 1 ? ` ×${found.results.length}` : "";
    return `${rangeText(found.took)}${often}`;
  };
  return (
    <li data-parting={parts || undefined} data-selected={selected || undefined}>
      <GhostName {...props} />
      <div className={style.track} aria-hidden>
        {own.map((step) => (
          <span key={step.visit}>
            {step.b && <GhostBar visit={step.b} axis={axes.b} ghost={false} />}
            {step.a && <GhostBar visit={step.a} axis={axes.a} ghost />}
          </span>
        ))}
      </div>
      <b className={style.took}>{words("b")}</b>
      <span className={style.took}>{words("a")}</span>
    </li>
  );
}

interface Props {
  found: Comparison;
  a: Run;
  b: Run;
  selected: string | null;
  onPick: (aid: string | null) => void;
}

function spanOf(steps: readonly ComparedStep[], begun: { a: number; b: number }): number {
  const ends = steps.flatMap(({ a, b }) => [
    ...(a ? [(visitEnd(a) ?? visitBegin(a) ?? begun.a) - begun.a] : []),
    ...(b ? [(visitEnd(b) ?? visitBegin(b) ?? begun.b) - begun.b] : []),
  ]);
  return wholeSpan(Math.max(0, ...ends) * 1.04);
}

/** Return whether a step belongs to this action or to one inside of it. */
function leadsTo({ levels, label }: ComparedAction, step: ComparedStep): boolean {
  const way = [...step.levels, step.name];
  return [...levels, label].every((each, depth) => way[depth] === each);
}

export function GhostLanes({ found, a, b, selected, onPick }: Props) {
  const [by, setBy] = useState<Alignment>("start");
  const step = found.parting?.step ?? null;
  const begun = beginnings(a, b, step, by);
  const span = spanOf(found.steps, begun);
  const axes = { a: { start: begun.a, span }, b: { start: begun.b, span } };
  const parts = partingAt(step, begun);
  const inside = useOpenLanes();
  const actions = useMemo(() => comparedActions(found), [found]);
  const shown = openLanes(actions, inside.open);
  const marked = shown.findLast((action) => step !== null && leadsTo(action, step))?.name;
  const nested = actions.some(({ holds }) => holds) ? inside : null;
  return (
    <section className={style.lanes} aria-label="Both runs over time">
      <header>
        {nested !== null && (
          <span className={style.levels}>
            <AllLevels lanes={actions} inside={nested} />
          </span>
        )}
        <span>
          A faded or hatched end: the moment of the end is known only to lie in this range.
        </span>
        <Segments
          size="xs"
          label="Where both begin"
          value={by}
          onChange={setBy}
          disabled={!step?.a || !step.b}
          data={[
            { value: "start", label: "At the start" },
            { value: "parting", label: "At difference 1" },
          ]}
        />
      </header>
      <div className={style.head} aria-hidden>
        <div className={style.ruler}>
          {ticksOf({ start: 0, span }).map((t) => (
            <span key={t} style={{ "--at": t / span } as CSSProperties}>
              {t < 60_000 ? `${t / 1000} s` : duration(t)}
            </span>
          ))}
          {parts !== null && (
            <b style={{ "--at": shareOf({ start: 0, span }, parts) } as CSSProperties}>
              1 · {duration(parts)}
            </b>
          )}
        </div>
        <span className={style.took}>run {found.b.number}</span>
        <span className={style.took}>run {found.a.number}</span>
      </div>
      <ul>
        {shown.map((action) => (
          <GhostLane
            key={action.name}
            action={action}
            axes={axes}
            steps={found.steps}
            parts={action.name === marked}
            selected={action.aid !== null && action.aid === selected}
            onPick={onPick}
            inside={nested}
          />
        ))}
      </ul>
    </section>
  );
}
