/** A graph drawn on the card of the action that stands for it, with what is expanded in it in turn. */
import {
  IconArrowsDiagonal,
  IconArrowsDiagonalMinimize2,
  IconStack2,
  IconStairsDown,
} from "@tabler/icons-react";
import { memo, useSyncExternalStore } from "react";
import { CardState } from "../../canvas/action-card";
import card from "../../canvas/action-card.module.css";
import { CardLines } from "../../canvas/card-lines";
import { actionsWord } from "../../canvas/folding/folding";
import { CARD_LINES } from "../../canvas/geometry/arrange";
import type { LevelFrameProps } from "../../canvas/graphs-inside";
import { graphsInside } from "../../canvas/graphs-inside";
import { ProblemBadge } from "../../canvas/marks/problem-marks";
import { STATE_LETTER } from "../../canvas/zoom-detail";
import type { Action, Direction } from "../../graph/model";
import { cardRows } from "../../graph/parameters/card-rows";
import type { Progress } from "../../status/progress";
import { StateLabel } from "../../status/state-label";
import { colorOfName } from "../../ui/name-colors";
import { isolated } from "../../words/isolated";
import { expansion } from "./expansion";
import style from "./level-frame.module.css";
import type { LevelGraph } from "./level-graph";
import { layoutOf } from "./level-layout";
import { LevelLines } from "./level-lines";
import { useMarkInside } from "./marks-inside";
import { useLevelProgress } from "./use-level-progress";

interface ButtonProps {
  label: string;
  keys?: string;
  Sign: typeof IconStack2;
  onClick: () => void;
}

function HeadButton({ label, keys, Sign, onClick }: ButtonProps) {
  return (
    <button
      type="button"
      className={`${style.button} nodrag`}
      title={keys === undefined ? label : `${label}  ${keys}`}
      aria-label={label}
      onClick={(event) => {
        event.stopPropagation(); // else the card would be chosen
        onClick();
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      <Sign size={15} aria-hidden />
    </button>
  );
}

const opensGraph = (name: string) => graphsInside.now()?.byName.has(name) ?? false;

function MarkInside({ path }: { path: string }) {
  const mark = useMarkInside(path);
  return mark && <ProblemBadge mark={mark} on="card" />;
}

interface InnerCardProps {
  action: Action;
  path: string;
  direction: Direction;
  progress: Progress | null;
  box: { readonly x: number; readonly y: number; readonly width: number; readonly height: number };
}

/** An action inside. It is drawn as its card is, and changed where one goes in. */
const InnerCard = memo(function InnerCard({
  action,
  path,
  direction,
  progress,
  box,
}: InnerCardProps) {
  const { name, instanceId, actor, inputs } = action;
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
      {actor !== "" && <span className={card.robot}>{actor}</span>}
      <MarkInside path={path} />
      <div className={card.head}>
        <b className={card.name} title={name}>
          {name}
        </b>
        {instanceId > 0 && <span className={card.instance}>{instanceId}</span>}
        {opensGraph(name) && (
          <HeadButton
            label={`Expand the graph inside ${isolated(name)}`}
            Sign={IconArrowsDiagonal}
            onClick={() => expansion.now().toggle(path)}
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
  const count =
    graph === null || typeof graph === "string" ? "" : actionsWord(graph.actions.length);
  return (
    <div className={style.head}>
      <IconStack2 size={15} aria-hidden />
      <b title={name}>
        <bdi>{name}</bdi>
      </b>
      {progress && <StateLabel tone={progress.tone} word={progress.word} />}
      <span className={style.count}>{count}</span>
      <span className={style.buttons}>
        <HeadButton
          label={`Open the graph inside ${isolated(name)}`}
          keys="]"
          Sign={IconStairsDown}
          onClick={() => expansion.now().enter(path)}
        />
        <HeadButton
          label={`Collapse the graph inside ${isolated(name)}`}
          keys="}"
          Sign={IconArrowsDiagonalMinimize2}
          onClick={() => expansion.now().toggle(path)}
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

/** On the card of an action of the canvas. */
export function ExpandedCard({ of, progress }: LevelFrameProps) {
  const level = useSyncExternalStore(expansion.subscribe, () => expansion.now().levels.get(of));
  if (!level) return null;
  const name = level.names.at(-1)?.name ?? "";
  return <LevelFrame level={level} name={name} progress={progress} />;
}
