/** The four outcomes of an action, each with its sign, word and colour. */
import { memo } from "react";

export const OUTCOMES = ["on_true", "on_false", "on_error", "on_stopped"] as const;
export type Outcome = (typeof OUTCOMES)[number];

export const outcomeWord: Record<Outcome, string> = {
  on_true: "true",
  on_false: "false",
  on_error: "error",
  on_stopped: "stopped",
};

export const outcomeColor: Record<Outcome, string> = {
  on_true: "var(--true)",
  on_false: "var(--false)",
  on_error: "var(--error)",
  on_stopped: "var(--stopped)",
};

/** The paths of Tabler's icons check, x, exclamation-mark and square-filled. */
const paths: Record<Outcome, string> = {
  on_true: "M5 12l5 5l10 -10",
  on_false: "M18 6l-12 12M6 6l12 12",
  on_error: "M12 19v.01M12 15v-10",
  on_stopped: "M19 2h-14a3 3 0 0 0 -3 3v14a3 3 0 0 0 3 3h14a3 3 0 0 0 3 -3v-14a3 3 0 0 0 -3 -3z",
};
const FIXED = { flex: "none" } as const;

/** Draws the sign of an outcome. A canvas has hundreds of them: the components of icons cost thrice as much. */
export const OutcomeSign = memo(function OutcomeSign(props: { outcome: Outcome; size?: number }) {
  const { outcome, size = 12 } = props;
  const filled = outcome === "on_stopped";
  const drawn = filled ? size * 0.8 : size;
  return (
    <svg
      viewBox="0 0 24 24"
      width={drawn}
      height={drawn}
      fill={filled ? "currentColor" : "none"}
      stroke={filled ? "none" : "currentColor"}
      strokeWidth={3}
      strokeLinecap="round"
      strokeLinejoin="round"
      style={FIXED}
      aria-hidden
    >
      <path d={paths[outcome]} />
    </svg>
  );
});
