/**
 * The card of an action: its robot, name, state and parameters, with a handle for its input and one
 * for each outcome.
 */
import { IconGhost2, IconMessageCircle } from "@tabler/icons-react";
import { Handle, type NodeProps, Position } from "@xyflow/react";
import { createContext, memo, type ReactNode, use, useRef } from "react";
import type { Action, Key } from "../graph/model";
import { cardRows } from "../graph/parameters/card-rows";
import { shownName } from "../graph/questions";
import { durationText } from "../status/durations";
import { type Progress, visitsText } from "../status/progress";
import { StateLabel, useInStep } from "../status/state-label";
import { colorOfName } from "../ui/name-colors";
import { stopwatch, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./action-card.module.css";
import { CardLines } from "./card-lines";
import {
  BreakpointSpot,
  InsideSpot,
  SinceSpot,
  useDataRole,
  useExpandedCard,
  useIsDimmed,
  useIsUnvisited,
  useOpenThreadCount,
} from "./editor-store";
import type { CardNode } from "./elements";
import { CARD_LINES, cardSize } from "./geometry/arrange";
import { ChangeTag, useChangeMark } from "./marks/change-marks";
import { ProblemBadge } from "./marks/problem-marks";
import { OUTCOMES, OutcomeSign, outcomeColor, outcomeWord } from "./outcome";
import { STATE_LETTER } from "./zoom-detail";

/** Replaces the state on cards where the canvas shows something else than one run. */
export const CardStateContext = createContext<((key: Key) => ReactNode) | null>(null);

/** Shows the state of an action in a run, its duration and its number of visits. */
export function CardState({ progress }: { progress: Progress }) {
  const now = useNow(1000, progress.since !== null);
  const parts: string[] = [];
  const took = durationText(progress);
  if (progress.since !== null) parts.push(stopwatch(now - progress.since));
  else if (took !== null) parts.push(took);
  const often = visitsText(progress);
  if (often !== "") parts.push(often);
  const more = parts.join(" · ");
  return (
    <div className={style.state} title={progress.inferred ? "Inferred, not seen" : undefined}>
      <StateLabel tone={progress.tone} word={progress.word} {...(more === "" ? {} : { more })} />
      {progress.inferred && <span className="ellipsis ink2 text-12_25">inferred</span>}
    </div>
  );
}

/** Shows the name of an action, and its old name where two moments are compared. */
function Head({ action, oldName }: { action: Action; oldName: string | null }) {
  return (
    <div className="flex items-baseline justify-between gap-6px" data-head>
      <b className={style.name} title={action.name}>
        {action.missing && <IconGhost2 size={13} aria-hidden />}
        {oldName && <del>{oldName}</del>}
        {shownName(action.name)}
      </b>
      {action.instanceId > 0 && (
        <span className="ink3 text-12_25 tabular">{action.instanceId}</span>
      )}
      <InsideSpot of={action.key} name={action.name} />
    </div>
  );
}

/** Shows whose the action is, at every zoom at which names are shown. */
export function RobotTag({ name }: { name: string }) {
  return (
    <span className={style.robot} data-robot title={name}>
      <bdi>{name}</bdi>
    </span>
  );
}

/** Shows everything that is read on a card: head, state and parameters. */
function CardText({ data, selected }: Pick<NodeProps<CardNode>, "data" | "selected">) {
  const { action, progress, givers } = data;
  const rows = cardRows(action.inputs, givers, progress?.inputs);
  const says = progress !== null || action.missing;
  const instead = use(CardStateContext)?.(action.key);
  const change = useChangeMark(action.key);
  return (
    <>
      <Head action={action} oldName={change?.oldName ?? null} />
      {action.missing && (
        <div className="ink-error text-12_25">named by an arrow, but not there</div>
      )}
      {!action.missing && (instead ?? (progress && <CardState progress={progress} />))}
      <CardLines
        rows={rows}
        most={says ? CARD_LINES - 1 : CARD_LINES}
        selected={selected}
        old={change?.oldValues}
        differing={change?.rows}
        inferred={progress?.inferred ?? false}
      />
    </>
  );
}

/** Return the place of the i-th outcome: 22 px apart on the right side, else spread along the lower edge. */
function spotOf(i: number, right: boolean): React.CSSProperties {
  return right ? { top: `calc(50% + ${(i - 1.5) * 22}px)` } : { left: `${14 + i * 24}%` };
}

export const ActionCard = memo(function ActionCard({
  data,
  selected,
  isConnectable,
}: NodeProps<CardNode>) {
  const { action, progress, mark, other, direction, robot } = data;
  const right = direction === "right";
  const expanded = useExpandedCard(action.key);
  const { height, width } = expanded?.size ?? cardSize(action, direction);
  const color = colorOfName(action.actor);
  const dim = useIsDimmed(action.actor);
  const talk = useOpenThreadCount(action.key);
  const role = useDataRole(action.key);
  const change = useChangeMark(action.key);
  const never = useIsUnvisited(action.key);
  const card = useRef<HTMLDivElement>(null);
  useInStep(card, progress?.tone === "run");
  return (
    <div
      ref={card}
      className={style.card}
      style={{ height, width, "--c": color, "--other": other ?? undefined } as React.CSSProperties}
      data-other={other === null ? undefined : true}
      data-selected={selected || undefined}
      data-tone={progress?.tone}
      data-name={shownName(action.name)}
      data-state={progress?.word}
      data-letter={STATE_LETTER[progress?.tone ?? "idle"] || undefined}
      data-ghost={action.missing || undefined}
      data-dim={dim || undefined}
      data-flow={role}
      data-direction={direction}
      data-change={change?.change}
      data-card={expanded ? undefined : true}
      data-unvisited={never || undefined}
    >
      <Handle
        type="target"
        id="in"
        position={right ? Position.Left : Position.Top}
        className={style.input ?? ""}
        data-side={right ? "left" : "top"}
        isConnectable={isConnectable}
        role="img"
        aria-label={`Input of ${isolated(action.name)} ${action.instanceId}`}
      />
      <BreakpointSpot of={action.key} on="card" />
      {robot !== "" && <RobotTag name={robot} />}
      {change && <ChangeTag mark={change} beside={robot !== ""} />}
      {never && <span className={style.never}>never run</span>}
      <SinceSpot of={action.key} on="card" />
      {mark && <ProblemBadge mark={mark} on="card" />}
      {talk > 0 && (
        <span className={style.talk} data-beside={mark ? true : undefined} title="Open comments">
          <IconMessageCircle size={11} aria-hidden /> {talk}
          <span className="visually-hidden"> open comments</span>
        </span>
      )}
      {expanded ? (
        <expanded.Frame of={action.key} progress={progress} />
      ) : (
        <CardText data={data} selected={selected} />
      )}
      {OUTCOMES.map((outcome, i) => (
        <Handle
          key={outcome}
          type="source"
          id={outcome}
          position={right ? Position.Right : Position.Bottom}
          className={style.outcome ?? ""}
          data-side={right ? "right" : "bottom"}
          isConnectable={isConnectable}
          data-outcome={outcome}
          role="img"
          aria-label={`When ${outcomeWord[outcome]}`}
          title={`When ${isolated(action.name)} ${action.instanceId} is ${outcomeWord[outcome]}`}
          style={{ ...spotOf(i, right), color: outcomeColor[outcome] }}
        >
          <OutcomeSign outcome={outcome} size={11} />
        </Handle>
      ))}
    </div>
  );
});
