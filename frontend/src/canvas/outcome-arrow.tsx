/**
 * The arrow of one outcome. The first arrow of a bundle draws the line and the pill; each draws the
 * piece from its own port.
 */
import { BaseEdge, EdgeLabelRenderer, type EdgeProps, useStoreApi } from "@xyflow/react";
import { memo, use, useLayoutEffect, useRef, useState } from "react";
import { boundedPart, lazyPart, PartBoundary } from "../ui/lazy-part";
import { pillWord } from "./arrows/bundles";
import { PILL_PLAY } from "./arrows/docks";
import { behindPill, pathOf } from "./arrows/line-path";
import { LineEditingContext, useIsOpen, useLine } from "./arrows/line-store";
import type { Point } from "./arrows/scene";
import type { RoutedLine } from "./arrows/simple-lines";
import { BreakpointSpot, SinceSpot, useUntakenOutcomes } from "./editor-store";
import type { Arrow } from "./elements";
import { ChangeSign, useChangeMark } from "./marks/change-marks";
import { HandMark } from "./marks/hand-mark";
import { ProblemBadge } from "./marks/problem-marks";
import { type Outcome, OutcomeSign, outcomeColor } from "./outcome";
import style from "./outcome-arrow.module.css";
import type { DraggedOutcome } from "./outcome-handles";

const OutcomeHandles = lazyPart(() =>
  import("./outcome-handles").then((part) => part.OutcomeHandles),
);
// An error notice has no place within SVG.
const BendHandles = boundedPart(
  () => import("./arrows/bend-handles").then((part) => part.BendHandles),
  { waiting: null, frame: () => null },
);

type ArrowData = NonNullable<Arrow["data"]>;

/**
 * Return the colour of a bundle: that of its only outcome or of the outcome that came, else a
 * neutral one.
 */
export function toneOf({
  bundle,
  entry,
  came,
}: Pick<ArrowData, "bundle" | "entry" | "came">): keyof typeof TIPS {
  if (entry) return "edge";
  if (bundle.response === "ignore") return "ignore";
  if (came !== null) return came;
  const [only, ...others] = bundle.outcomes;
  return only && others.length === 0 ? only : "edge";
}

/** Return the place of a pill; it moves away from its card while single ports are shown. */
function pillPlace({ pill, docked, direction }: RoutedLine, open: boolean): Point | null {
  if (!pill || !docked || !open) return pill;
  return direction === "right" ? [pill[0] + PILL_PLAY, pill[1]] : [pill[0], pill[1] + PILL_PLAY];
}

/** Return the corners of the piece from a port to the pill of its bundle. */
function portPiece(line: RoutedLine, x: number, y: number, pill: Point): Point[] {
  const [side] = line.points;
  if (line.direction === "right") {
    const turn = (side?.[0] ?? x) + 15;
    return [[x - 10, y], [turn, y], [turn, pill[1]], pill];
  }
  const turn = (side?.[1] ?? y) + 15;
  return [[x, y - 10], [x, turn], [pill[0], turn], pill];
}

export const OutcomeArrow = memo(function OutcomeArrow(props: EdgeProps<Arrow>) {
  const { id, data, selected, sourceX, sourceY, targetX, targetY } = props;
  const group = useRef<SVGGElement>(null);
  const bundle = data?.bundle.id ?? "";
  const line = useLine(bundle);
  const open = useIsOpen(bundle) || selected === true;
  const [endX, endY] = line?.points.at(-1) ?? [targetX, targetY];
  const [dx, dy] = line?.direction === "right" ? [0, endY - targetY] : [endX - targetX, 0];
  useLayoutEffect(() => {
    // React Flow places the handle that moves the end of an arrow at the input of the card.
    const edge = group.current?.closest<SVGGElement>(".react-flow__edge");
    edge?.style.setProperty("--end", `${dx}px ${dy}px`);
  }, [dx, dy]);
  if (!data || !line) return <g ref={group} />;
  const pill = pillPlace(line, open);
  const opened = open && line.docked && pill !== null && !data.entry && !data.portless;
  return (
    <g ref={group}>
      {data.lead && (
        <BundleLine {...{ id, data, line, pill, opened }} selected={selected === true} />
      )}
      {opened && (
        <BaseEdge
          id={`${id}|port`}
          path={pathOf(portPiece(line, sourceX, sourceY, pill), 5)}
          interactionWidth={14}
          className={style.portPiece ?? ""}
          style={{ stroke: outcomeColor[data.outcome], strokeWidth: data.lit ? 2.75 : 2 }}
        />
      )}
      {data.lead && pill && (
        <Pill
          {...{ id, data }}
          x={pill[0]}
          y={pill[1]}
          lean={line.lean === true}
          selected={selected === true}
        />
      )}
      {data.lead && selected && <BendHandles arrow={id} bundle={data.bundle} line={line} />}
    </g>
  );
});

interface BundleProps {
  id: string;
  data: ArrowData;
  selected: boolean;
}

interface LineProps extends BundleProps {
  line: RoutedLine;
  pill: Point | null;
  opened: boolean;
}

// Memoized with the pill, since React Flow renders an arrow again when it has measured its cards.
const BundleLine = memo(function BundleLine(props: LineProps) {
  const { id, data, line, pill, selected, opened } = props;
  const change = useChangeMark(data.relation)?.change;
  const tone = change ?? toneOf(data);
  const lit = data.lit || data.came !== null;
  const path = pathOf(pill && opened ? [pill, ...behindPill(line)] : line.points);
  return (
    <>
      {change === "changed" && <path d={path} className={style.double} />}
      <BaseEdge
        id={id}
        path={path}
        interactionWidth={22}
        markerEnd={`url(#tip-${tone})`}
        style={{
          stroke: TIPS[tone],
          strokeWidth: lit || change ? 2.75 : selected ? 2.5 : 1.8,
          ...(data.passed && !data.ghost ? { opacity: 0.38 } : {}),
          ...(data.bundle.optional ? { strokeDasharray: "5 4" } : {}),
          ...(data.ghost ? { strokeDasharray: "1 5", strokeLinecap: "round", strokeWidth: 3 } : {}),
          ...(change ? CHANGED_LINES[change] : {}),
        }}
      />
    </>
  );
});

/**
 * Added lines are solid, removed ones dashed, and changed ones double: this style paints the gap in
 * the middle.
 */
const CHANGED_LINES = {
  added: { strokeDasharray: "none" },
  removed: { strokeDasharray: "7 5" },
  changed: { stroke: "var(--canvas)", strokeWidth: 1.6, strokeDasharray: "none" },
} as const;

interface PillProps extends BundleProps {
  x: number;
  y: number;
  /** There is room for outcomes and response only. */
  lean: boolean;
}

/** Shows outcomes and response of a bundle. Screen readers get the same from the label of the arrow. */
const Pill = memo(function Pill({ id, data, x, y, lean, selected }: PillProps) {
  const store = useStoreApi();
  const editing = use(LineEditingContext);
  const [dragged, setDragged] = useState<DraggedOutcome | null>(null);
  const word = pillWord(data.bundle);
  const change = useChangeMark(data.relation);
  const untaken = useUntakenOutcomes(data.relation);
  const never = data.bundle.outcomes.filter((outcome) => untaken.includes(outcome));
  const glyphs = <Glyphs outcomes={data.bundle.outcomes} untaken={untaken} />;
  return (
    <>
      {dragged && <DraggedLine from={[x, y]} dragged={dragged} />}
      <EdgeLabelRenderer>
        <div
          className={style.pill}
          data-selected={selected || undefined}
          data-passed={data.passed || undefined}
          data-change={change?.change}
          data-untaken={never.length > 0 || undefined}
          // One pill of each relation has the id, so that tests and searches find one element.
          data-relation={data.answers || data.entry ? data.relation : undefined}
          style={{ transform: `translate(-50%, -50%) translate(${x}px, ${y}px)` }}
        >
          {change && <ChangeSign mark={change} />}
          <SinceSpot of={data.relation} on="arrow" />
          {(data.answers ?? data.entry) && <BreakpointSpot of={data.relation} on="arrow" />}
          {data.mark && !lean && (
            // biome-ignore lint/a11y/noStaticElementInteractions: chosen by keys like every arrow
            // biome-ignore lint/a11y/useKeyWithClickEvents: the arrow itself is chosen by keys
            <span className={style.mark} onClick={() => store.getState().addSelectedEdges([id])}>
              <ProblemBadge mark={data.mark} on="arrow" />
            </span>
          )}
          {data.entry ? null : selected && editing ? (
            <PartBoundary waiting={glyphs} frame={() => glyphs}>
              <OutcomeHandles bundle={data.bundle} editing={editing} onDrag={setDragged} />
            </PartBoundary>
          ) : (
            glyphs
          )}
          {data.hand && !lean && (
            // biome-ignore lint/a11y/noStaticElementInteractions: chosen by keys like every arrow
            // biome-ignore lint/a11y/useKeyWithClickEvents: the arrow itself is chosen by keys
            <span className={style.mark} onClick={() => store.getState().addSelectedEdges([id])}>
              <HandMark hand={data.hand} />
            </span>
          )}
          {never.length > 0 && (
            <span className="ink2">
              <span aria-hidden>∅</span>
              <span className="visually-hidden">never taken</span>
            </span>
          )}
          {word !== "" && (
            <span className={style.word} aria-hidden>
              {word}
            </span>
          )}
        </div>
      </EdgeLabelRenderer>
    </>
  );
});

interface GlyphsProps {
  outcomes: readonly Outcome[];
  /** Outcomes that no expected course takes. */
  untaken: readonly Outcome[];
}

/** Shows the signs of outcomes in their colours. */
export function Glyphs({ outcomes, untaken }: GlyphsProps) {
  return outcomes.map((outcome) => (
    <span
      key={outcome}
      className={style.glyph}
      data-untaken={untaken.includes(outcome) || undefined}
      style={{ color: outcomeColor[outcome] }}
    >
      <OutcomeSign outcome={outcome} size={11} />
    </span>
  ));
}

/** Draws the line from the pill to the place to which an outcome is dragged. */
function DraggedLine({ from, dragged }: { from: Point; dragged: DraggedOutcome }) {
  const { outcome, at } = dragged;
  return (
    <path
      className={style.dragged}
      d={`M${from[0]} ${from[1]}L${at[0]} ${at[1]}`}
      style={{ stroke: outcomeColor[outcome] }}
      markerEnd={`url(#tip-${outcome})`}
    />
  );
}

/** The colours of lines and arrow heads by what they show. */
export const TIPS = {
  edge: "var(--edge)",
  ignore: "var(--ink4)",
  on_true: "var(--true)",
  on_false: "var(--false)",
  on_error: "var(--error)",
  on_stopped: "var(--stopped)",
  added: "var(--added)",
  removed: "var(--removed)",
  changed: "var(--changed)",
} as const;

/** Defines the arrow heads in all colours; each canvas renders it once. */
export function ArrowTips() {
  return (
    <svg aria-hidden className={style.tips}>
      <defs>
        {Object.entries(TIPS).map(([name, fill]) => (
          <marker
            key={name}
            id={`tip-${name}`}
            viewBox="0 0 10 10"
            refX="7"
            refY="5"
            markerWidth="9"
            markerHeight="9"
            markerUnits="userSpaceOnUse"
            orient="auto-start-reverse"
          >
            <path d="M0 0.8 9 5 0 9.2Z" style={{ fill }} />
          </marker>
        ))}
      </defs>
    </svg>
  );
}
