/** How an engine is, in a word with a symbol. */
import {
  IconCircleCheck,
  IconHelpCircle,
  IconHourglass,
  IconPlugConnectedX,
  IconRotateClockwise2,
} from "@tabler/icons-react";
import type { EngineState, Robot } from "../api/robots";
import style from "./engine-label.module.css";

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
    <span className={style.word} data-state={robot.state} title={robot.why || undefined}>
      <Sign size={14} stroke={2.2} aria-hidden /> {word}
    </span>
  );
}
