/** A state as sign, word and colour. */
import {
  IconCheck,
  IconCircle,
  IconCircleCheck,
  IconExclamationMark,
  IconHelpCircle,
  IconHourglass,
  IconLoader2,
  IconPlugConnectedX,
  IconQuestionMark,
  IconRotateClockwise2,
  IconSquareFilled,
  IconX,
} from "@tabler/icons-react";
import { type RefObject, useEffect, useRef } from "react";
import type { EngineState, Robot } from "../api/robots";
import type { Tone } from "./progress";
import style from "./state-label.module.css";

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
      {more !== undefined && <span className="weight-500">· {more}</span>}
    </span>
  );
}

const WORDS: Record<EngineState, { word: string; sign: typeof IconCircleCheck }> = {
  answering: { word: "answers", sign: IconCircleCheck },
  busy: { word: "there, but silent", sign: IconHourglass },
  gone: { word: "gone", sign: IconPlugConnectedX },
  restarted: { word: "restarted", sign: IconRotateClockwise2 },
  no_link: { word: "no link", sign: IconHelpCircle },
};

export function EngineLabel({ robot }: { robot: Robot }) {
  const { word, sign: Sign } = WORDS[robot.state];
  return (
    <span className={style.engineLabelWord} data-state={robot.state} title={robot.why || undefined}>
      <Sign size={14} stroke={2.2} aria-hidden /> {word}
    </span>
  );
}

/**
 * Animations of an element that begin at their own times have the page painted at as many times in
 * each second, which a machine without a GPU has no time for. `on`: it moves now.
 */
export function useInStep(element: RefObject<Element | null>, on: boolean): void {
  useEffect(() => {
    if (!on) return;
    for (const animation of element.current?.getAnimations?.({ subtree: true }) ?? [])
      if (animation instanceof CSSAnimation) animation.startTime = 0;
  }, [element, on]);
}
