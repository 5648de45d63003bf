/** The mark of an arrow that leads from one robot to another: the first letter of each in its colour. */
import { type HandOver, handOverLabel } from "../../graph/robots";
import { colorOfName, firstLetter } from "../../ui/name-colors";
import style from "./hand-mark.module.css";

function Letter({ of }: { of: string }) {
  return <i style={{ background: colorOfName(of) }}>{of === "" ? "·" : firstLetter(of)}</i>;
}

/** Shows both robots; the words are its tooltip. Screen readers get them from the label of the arrow. */
export function HandMark({ hand }: { hand: HandOver }) {
  return (
    <span className={style.mark} title={handOverLabel(hand)} data-hand aria-hidden>
      <Letter of={hand.from} />
      <b>›</b>
      <Letter of={hand.to} />
    </span>
  );
}
