/** The four outcomes of an action, each with its sign, word and colour. */
import { IconCheck, IconExclamationMark, IconSquareFilled, IconX } from "@tabler/icons-react";

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

const signs = {
  on_true: IconCheck,
  on_false: IconX,
  on_error: IconExclamationMark,
  on_stopped: IconSquareFilled,
} as const;

export function OutcomeSign({ outcome, size = 12 }: { outcome: Outcome; size?: number }) {
  const Sign = signs[outcome];
  const drawn = outcome === "on_stopped" ? size * 0.8 : size;
  return <Sign size={drawn} stroke={3} aria-hidden style={{ flex: "none" }} />;
}
