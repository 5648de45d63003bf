/** Draws a graph on the card of the action that stands for it: its cards, arrows, states and problems. */

import {
  IconArrowsDiagonal,
  IconArrowsDiagonalMinimize2,
  IconStack2,
  IconStairsDown,
} from "@tabler/icons-react";
import { memo, useMemo } from "react";
import { CardState, RobotTag } from "../canvas/action-card";
import card from "../canvas/action-card.module.css";
import { pillWord } from "../canvas/arrows/bundles";
import { pathOf } from "../canvas/arrows/line-path";
import { CardLines } from "../canvas/card-lines";
import { type LevelFrameProps, type LevelGraph, useEditorStore } from "../canvas/editor-store";
import { CARD_LINES } from "../canvas/geometry/arrange";
import { HandMark } from "../canvas/marks/hand-mark";
import {
  ProblemBadge,
  type ProblemMark,
  type ProblemMarks,
  problemMarksOf,
} from "../canvas/marks/problem-marks";
import { Glyphs, TIPS, toneOf } from "../canvas/outcome-arrow";
import { STATE_LETTER } from "../canvas/zoom-detail";
import type { DryRun } from "../dry-run/use-dry-run";
import { useEditorContext } from "../edit-actions/editor-context";
import { type Action, type Direction, fullName, type Key, type Precondition } from "../graph/model";
import { cardRows } from "../graph/parameters/card-rows";
import type { ProblemGroup } from "../graph/problems/problem-groups";
import { hasSeveralRobots } from "../graph/robots";
import type { Progress } from "../status/progress";
import { progressBelow, type RunOnCanvas } from "../status/progress-inside";
import { StateLabel } from "../status/state-label";
import { colorOfName } from "../ui/name-colors";
import { useWatched } from "../ui/watched";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./level-frame.module.css";
import { type LevelLayout, layoutOf } from "./level-layout";

const NO_PROGRESS: ReadonlyMap<Key, Progress> = new Map();

/**
 * Return the name that an engine gives to an inner graph, such as `OUTER__INNER__0` (docs/umrf-and-
 * the-engine.md 2.6).
 */
const calledBy = (outermost: string, { names }: LevelGraph): string =>
  [outermost, ...names.flatMap(({ name, instanceId }) => [name, String(instanceId)])].join("__");

/** The sources of states: a dry-run, or a run. */
export interface StateSource {
  readonly dryRun: Pick<DryRun, "inside"> | null;
  readonly run: RunOnCanvas | null;
  /** The name of the graph on the canvas. */
  readonly outermost: string;
}

/** Return the states of a level's actions; empty while nothing runs or the level is not loaded. */
export function progressOf(
  level: LevelGraph,
  { dryRun, run, outermost }: StateSource,
): ReadonlyMap<Key, Progress> {
  const { graph } = level;
  if (graph === null || typeof graph === "string") return NO_PROGRESS;
  if (dryRun) return dryRun.inside({ ...graph, name: calledBy(outermost, level) });
  return run ? progressBelow(run, graph, level.names.map(fullName)) : NO_PROGRESS;
}

function useLevelProgress(level: LevelGraph): ReadonlyMap<Key, Progress> {
  const { dryRun, graph, store } = useEditorContext();
  const { name: outermost } = graph;
  const run = useWatched(store.run);
  return useMemo(
    () => progressOf(level, { dryRun, run, outermost }),
    [level, dryRun, run, outermost],
  );
}

let last: { told: readonly ProblemGroup[]; marks: ProblemMarks } | null = null;

/**
 * Return the marks of problems in inner graphs, by the keys of the actions down to each, joined by
 * "/". Each level shows all problems below it.
 */
export function marksInside(told: readonly ProblemGroup[]): ProblemMarks {
  if (last?.told === told) return last.marks;
  const each = told.flatMap((one) => {
    const { inside } = one.problems[0];
    if (inside === undefined) return [];
    const { aid } = inside.where ?? {};
    const way = aid === undefined ? inside.aids : [...inside.aids, aid];
    return way.slice(1).map((_, i) => ({
      ...{ ...one, code: inside.code, message: inside.message },
      place: way.slice(0, i + 2).join("/"),
    }));
  });
  last = { told, marks: problemMarksOf(each) };
  return last.marks;
}

function useMarkInside(path: string): ProblemMark | undefined {
  return useWatched(useEditorStore().problems, (told) => marksInside(told).get(path));
}

const NO_OUTCOMES: readonly Precondition[] = [];

interface LevelLineProps {
  of: LevelLayout["lines"][number];
  /** The outcome of its parent. */
  ended: string | undefined;
}

/** Return the outcome of a line with which its parent ended; null: none of them. */
const cameOf = ({ bundle }: LevelLineProps["of"], ended: string | undefined): Precondition | null =>
  bundle.outcomes.find((outcome) => outcome === `on_${ended}`) ?? null;

function Line({ of, ended }: LevelLineProps) {
  const { bundle, line } = of;
  const came = bundle.entry ? null : cameOf(of, ended);
  const tone = toneOf({ bundle, entry: bundle.entry, came });
  return (
    <path
      d={pathOf(line.points)}
      fill="none"
      markerEnd={`url(#tip-${tone})`}
      style={{ stroke: TIPS[tone] }}
      strokeWidth={came === null ? 1.8 : 2.75}
      strokeDasharray={bundle.optional ? "5 4" : undefined}
    />
  );
}

function Pill({ of: { bundle, hand, line } }: Pick<LevelLineProps, "of">) {
  const word = pillWord(bundle);
  if (!line.pill || (word === "" && bundle.outcomes.length === 0)) return null;
  const [left, top] = line.pill;
  return (
    <div className={style.pill} style={{ left, top }}>
      {!bundle.entry && <Glyphs outcomes={bundle.outcomes} untaken={NO_OUTCOMES} />}
      {hand && <HandMark hand={hand} />}
      {word}
    </div>
  );
}

interface LevelLinesProps {
  lines: LevelLayout["lines"];
  progress: ReadonlyMap<Key, Progress>;
}

const LevelLines = memo(function LevelLines({ lines, progress }: LevelLinesProps) {
  return (
    <>
      <svg className={style.lines} aria-hidden>
        {lines.map((each) => (
          <Line key={each.bundle.id} of={each} ended={progress.get(each.bundle.source)?.tone} />
        ))}
      </svg>
      {lines.map((each) => (
        <Pill key={each.bundle.id} of={each} />
      ))}
    </>
  );
});

interface ButtonProps {
  label: string;
  keys?: string;
  small?: boolean;
  Sign: typeof IconStack2;
  onClick: () => void;
}

/** A button on a card; `small`: in the head of a card of the canvas. */
export function CardButton({ label, keys, Sign, small = false, onClick }: ButtonProps) {
  return (
    <button
      type="button"
      className={`${style.button} nodrag`}
      data-small={small || undefined}
      title={keys === undefined ? label : `${label}  ${keys}`}
      aria-label={label}
      onClick={(event) => {
        event.stopPropagation(); // else the click would select the card
        onClick();
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      <Sign size={small ? 14 : 15} aria-hidden />
    </button>
  );
}

function MarkInside({ path }: { path: string }) {
  const mark = useMarkInside(path);
  return mark && <ProblemBadge mark={mark} on="card" />;
}

interface InnerCardProps {
  action: Action;
  path: string;
  direction: Direction;
  progress: Progress | null;
  /** The name of its robot; "" for any robot, and where all actions beside it are one robot's. */
  robot: string;
  box: { readonly x: number; readonly y: number; readonly width: number; readonly height: number };
}

/** The card of an inner action: it looks like a card of the canvas, and is edited in its own graph. */
const InnerCard = memo(function InnerCard({
  action,
  path,
  direction,
  progress,
  robot,
  box,
}: InnerCardProps) {
  const { name, instanceId, actor, inputs } = action;
  const { graphsInside } = useEditorStore();
  return (
    <div
      className={`${card.card} ${style.card}`}
      style={
        {
          ...{ left: box.x, top: box.y, width: box.width, height: box.height },
          "--c": colorOfName(actor),
        } as React.CSSProperties
      }
      data-card
      data-inner={path}
      data-name={name}
      data-direction={direction}
      data-tone={progress?.tone}
      data-state={progress?.word}
      data-letter={STATE_LETTER[progress?.tone ?? "idle"] || undefined}
    >
      {robot !== "" && <RobotTag name={robot} />}
      <MarkInside path={path} />
      <div className="flex items-baseline justify-between gap-6px">
        <b className={card.name} title={name}>
          {name}
        </b>
        {instanceId > 0 && <span className="ink3 text-12_25 tabular">{instanceId}</span>}
        {graphsInside.now()?.byName.has(name) && (
          <CardButton
            label={`Expand the graph inside ${isolated(name)}`}
            Sign={IconArrowsDiagonal}
            onClick={() => graphsInside.now()?.expand.toggle(path)}
          />
        )}
      </div>
      {progress && <CardState progress={progress} />}
      <CardLines
        rows={cardRows(inputs, undefined, progress?.inputs)}
        most={progress ? CARD_LINES - 1 : CARD_LINES}
        selected={false}
        old={undefined}
        differing={undefined}
        inferred={progress?.inferred ?? false}
      />
    </div>
  );
});

interface FrameProps {
  level: LevelGraph;
  name: string;
  progress: Progress | null;
}

function Head({ level, name, progress }: FrameProps) {
  const { graph, path } = level;
  const { graphsInside } = useEditorStore();
  const count =
    graph === null || typeof graph === "string" ? "" : counted(graph.actions.length, "action");
  return (
    <div className={style.head}>
      <IconStack2 size={15} aria-hidden />
      <b title={name}>
        <bdi>{name}</bdi>
      </b>
      {progress && <StateLabel tone={progress.tone} word={progress.word} />}
      <span className="ink2 text-12_25">{count}</span>
      <span className={style.buttons}>
        <CardButton
          label={`Open the graph inside ${isolated(name)}`}
          keys="]"
          Sign={IconStairsDown}
          onClick={() => graphsInside.now()?.enter(path)}
        />
        <CardButton
          label={`Collapse the graph inside ${isolated(name)}`}
          keys="}"
          Sign={IconArrowsDiagonalMinimize2}
          onClick={() => graphsInside.now()?.expand.toggle(path)}
        />
      </span>
    </div>
  );
}

function LevelBody({ level }: { level: LevelGraph }) {
  const { cards, lines, direction } = layoutOf(level);
  const progress = useLevelProgress(level);
  const { graph } = level;
  if (graph === null) return <p className={style.said}>Loading…</p>;
  if (typeof graph === "string") return <p className={style.said}>{graph}</p>;
  if (cards.length === 0) return <p className={style.said}>Nothing is drawn in it yet.</p>;
  const named = hasSeveralRobots(graph.actions);
  return (
    <>
      <LevelLines lines={lines} progress={progress} />
      {cards.map(({ action, ...box }) => {
        const inner = level.levels.get(action.key);
        const own = progress.get(action.key) ?? null;
        const { x: left, y: top, width, height } = box;
        return inner ? (
          <div
            key={action.key}
            className={`${card.card} ${style.card}`}
            style={{ left, top, width, height }}
            data-tone={own?.tone}
          >
            <MarkInside path={inner.path} />
            <LevelFrame level={inner} name={action.name} progress={own} />
          </div>
        ) : (
          <InnerCard
            key={action.key}
            action={action}
            path={`${level.path}/${action.key}`}
            direction={direction}
            progress={own}
            robot={named ? action.actor : ""}
            box={box}
          />
        );
      })}
    </>
  );
}

function LevelFrame({ level, name, progress }: FrameProps) {
  return (
    // biome-ignore lint/a11y/useSemanticElements: a fieldset is of a form
    <div
      className={style.frame}
      role="group"
      aria-label={`Graph inside ${isolated(name)}`}
      data-level={level.path}
    >
      <Head level={level} name={name} progress={progress} />
      <LevelBody level={level} />
    </div>
  );
}

/** Draws the expanded graph on the card of an action of the canvas. */
export function ExpandedCard({ of, progress }: LevelFrameProps) {
  const level = useWatched(useEditorStore().expanded, (expanded) => expanded?.levels.get(of));
  if (!level) return null;
  const name = level.names.at(-1)?.name ?? "";
  return <LevelFrame level={level} name={name} progress={progress} />;
}
