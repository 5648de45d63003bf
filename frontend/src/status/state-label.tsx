/** A state as sign, word and colour. */
import {
  IconCheck,
  IconCircle,
  IconCircleCheck,
  IconExclamationMark,
  IconLoader2,
  IconQuestionMark,
  IconSquareFilled,
  IconX,
} from "@tabler/icons-react";
import { useRef } from "react";
import type { Tone } from "./progress";
import style from "./state-label.module.css";
import { useInStep } from "./use-in-step";

const signs = {
  idle: IconCircle,
  run: IconLoader2,
  true: IconCheck,
  false: IconX,
  error: IconExclamationMark,
  stopped: IconSquareFilled,
  done: IconCircleCheck,
  unknown: IconQuestionMark,
} as const;

export const toneColor: Record<Tone, string> = {
  idle: "var(--ink3)",
  run: "var(--run)",
  true: "var(--true)",
  false: "var(--false)",
  error: "var(--error)",
  stopped: "var(--stopped)",
  done: "var(--ink2)",
  unknown: "var(--warn)",
};

interface Props {
  tone: Tone;
  word: string;
  more?: string;
  pill?: boolean;
  /** Its sign does not turn: something else beside it moves already. */
  still?: boolean;
}

export function StateLabel({ tone, word, more, pill = false, still = false }: Props) {
  const Sign = signs[tone];
  const label = useRef<HTMLSpanElement>(null);
  const turns = tone === "run" && !still;
  useInStep(label, turns);
  return (
    <span
      ref={label}
      className={pill ? style.pill : style.word}
      style={{ color: toneColor[tone] }}
      data-tone={tone}
    >
      <span className={turns ? style.turning : style.sign} aria-hidden>
        <Sign size={tone === "stopped" ? 9 : 12} stroke={2.8} />
      </span>
      {word}
      {more !== undefined && <span className={style.more}>· {more}</span>}
    </span>
  );
}
