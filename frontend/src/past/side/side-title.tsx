/** Over a canvas: which of two moments it is. */
import style from "./side.module.css";

export function SideTitle({ side, words }: { side: "Earlier" | "Later"; words: string }) {
  return (
    <p className={style.title} data-side={side}>
      <b>{side}</b> <bdi>{words}</bdi>
    </p>
  );
}
