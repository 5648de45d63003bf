/** Rows of a long list in blocks: a block out of sight is neither laid out nor drawn, and keeps its room. */
import { Children, type ReactNode } from "react";
import style from "./long-list.module.css";

const ROWS = 25; // of a block: about as many as a screen shows

interface Props {
  /** Usual height of a row, rem: rows out of sight take as much. */
  rowHeight: number;
  children: ReactNode;
}

export function LongList({ rowHeight, children }: Props) {
  const rows = Children.toArray(children);
  const blocks = Array.from({ length: Math.ceil(rows.length / ROWS) }, (_, i) =>
    rows.slice(i * ROWS, (i + 1) * ROWS),
  );
  return blocks.map((block, i) => (
    <div
      // biome-ignore lint/suspicious/noArrayIndexKey: a block is the place that it has
      key={i}
      className={style.block}
      style={{ containIntrinsicBlockSize: `auto ${block.length * rowHeight}rem` }}
    >
      {block}
    </div>
  ));
}
