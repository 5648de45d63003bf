/** The mark of a breakpoint, on a card, an arrow or a row of the outline: a disc, with a dot in it where it has conditions. */
import style from "./breakpoint-mark.module.css";

interface BreakpointMarkProps {
  /** The action or relation that has it. */
  of: string;
  on: "card" | "arrow" | "row";
  /** Text that says what it does. */
  words: string;
}

/** Shows where a led run waits; what it depends on is its tooltip. */
export function BreakpointMark({ of, on, words }: BreakpointMarkProps) {
  return (
    <span
      className={style.mark}
      data-on={on}
      data-if={words.includes(":") || undefined}
      data-breakpoint={of}
      title={words}
    >
      <span className="visually-hidden">{words}.</span>
    </span>
  );
}
