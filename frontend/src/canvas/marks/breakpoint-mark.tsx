/** The mark of a breakpoint, on a card or an arrow: a disc, with a dot in it where it has conditions. */
import { useBreakpointWords } from "../editor-store";
import style from "./breakpoint-mark.module.css";

/** Shows where a led run waits; what it depends on is its tooltip. */
export function BreakpointMark({ of, on }: { of: string; on: "card" | "arrow" }) {
  const words = useBreakpointWords(of);
  if (words === undefined) return null;
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
