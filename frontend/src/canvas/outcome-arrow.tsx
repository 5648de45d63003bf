/** An arrow from one outcome to what answers it, with the relation's answers in words. */
import { BaseEdge, EdgeLabelRenderer, type EdgeProps, useStoreApi } from "@xyflow/react";
import { memo } from "react";
import type { Arrow, OutcomeResponse } from "./elements";
import { arrowPathOf } from "./geometry/arrow-path";
import { OutcomeSign, outcomeColor, outcomeWord } from "./outcome";
import style from "./outcome-arrow.module.css";
import { ProblemBadge } from "./problem-badge";

function AnswerLine({ answer, optional }: { answer: OutcomeResponse; optional: boolean }) {
  return (
    <span className={style.answer}>
      {answer.outcomes.map((outcome) => (
        <span key={outcome} className={style.part} style={{ color: outcomeColor[outcome] }}>
          <OutcomeSign outcome={outcome} size={10} />
          {outcomeWord[outcome]}
        </span>
      ))}
      <span className={style.response}>
        → {answer.response}
        {optional && " · optional"}
      </span>
    </span>
  );
}

const SHIFTS = { left: "-10px", middle: "-50%", right: "calc(-100% + 10px)" } as const;

export const OutcomeArrow = memo(function OutcomeArrow(props: EdgeProps<Arrow>) {
  const { id, data, selected } = props;
  const store = useStoreApi();
  const { path, ...middle } = arrowPathOf(props, data?.lane ?? null);
  if (!data) return null;
  const { x, y, anchor } = data.label ?? middle;
  const color = data.entry
    ? "var(--ink3)"
    : data.response === "ignore"
      ? "var(--ink4)"
      : outcomeColor[data.outcome];
  const dash = data.entry || data.response === "run" ? undefined : "6 4";
  return (
    <>
      <BaseEdge
        id={id}
        path={path}
        interactionWidth={22}
        markerEnd={`url(#tip-${data.entry ? "entry" : data.response === "ignore" ? "ignore" : data.outcome})`}
        style={{
          stroke: color,
          strokeWidth: selected ? 3 : data.lit ? 2.6 : 1.8,
          ...(dash ? { strokeDasharray: dash } : {}),
        }}
      />
      {(data.answers || data.mark) && (
        <EdgeLabelRenderer>
          <button
            type="button"
            tabIndex={-1}
            className={style.label}
            onClick={() => store.getState().addSelectedEdges([id])}
            data-selected={selected || undefined}
            data-plain={(data.answers && isPlain(data.answers)) || undefined}
            data-relation={data.relation}
            style={{ transform: `translate(${SHIFTS[anchor]}, -50%) translate(${x}px, ${y}px)` }}
          >
            {data.mark && <ProblemBadge mark={data.mark} on="arrow" />}
            {data.answers && (
              <span className={style.answers}>
                {data.answers.map((answer, i) => (
                  <AnswerLine
                    key={answer.response}
                    answer={answer}
                    optional={data.optional && i === (data.answers?.length ?? 0) - 1}
                  />
                ))}
                {data.answers.length === 0 && <span className={style.response}>ignores all</span>}
              </span>
            )}
          </button>
        </EdgeLabelRenderer>
      )}
    </>
  );
});

/** Only `true → run`: what most arrows say, so it may be quiet. */
function isPlain(answers: readonly OutcomeResponse[]): boolean {
  const [only] = answers;
  return answers.length === 1 && only?.response === "run" && only.outcomes.join() === "on_true";
}

const TIPS = {
  entry: "var(--ink3)",
  ignore: "var(--ink4)",
  on_true: "var(--true)",
  on_false: "var(--false)",
  on_error: "var(--error)",
  on_stopped: "var(--stopped)",
} as const;

/** Arrow heads in the colours of the outcomes; once per canvas. */
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
