/** Thin lines between lanes where one robot waited for another, with their milliseconds. */
import { type RefObject, useLayoutEffect, useState } from "react";
import { shareOf, type TimeAxis } from "./axis";
import { type HandOver, handOverTime, handOverWords } from "./hand-overs";
import style from "./timeline.module.css";

interface Props {
  overs: readonly HandOver[];
  axis: TimeAxis;
  /** The list of lanes, whose rows are measured. */
  list: RefObject<HTMLElement | null>;
  /** Changes with the rows that are shown. */
  rows: string;
}

/** Return the middle of each row, px from the top of the list. */
function useMiddles(list: Props["list"], rows: string): ReadonlyMap<string, number> {
  const [middles, setMiddles] = useState<ReadonlyMap<string, number>>(new Map());
  // biome-ignore lint/correctness/useExhaustiveDependencies: measured again when other rows are shown
  useLayoutEffect(() => {
    const box = list.current;
    if (box === null) return;
    const found = box.querySelectorAll<HTMLElement>("[data-lane]");
    const middle = (row: HTMLElement) => row.offsetTop + row.offsetHeight / 2;
    setMiddles(new Map([...found].map((row) => [row.dataset.lane ?? "", middle(row)])));
  }, [list, rows]);
  return middles;
}

export function HandOverLines({ overs, axis, list, rows }: Props) {
  const middles = useMiddles(list, rows);
  const newest = new Map(overs.map((over) => [over.to, over]));
  return (
    <li className={style.handOvers} aria-hidden>
      {overs.map((over) => {
        const [from, to] = [middles.get(over.from), middles.get(over.to)];
        if (from === undefined || to === undefined) return null;
        const [left, right] = [shareOf(axis, over.ended), shareOf(axis, over.began)];
        return (
          <i
            key={`${over.to} ${over.began}`}
            className={style.handOver}
            data-up={to < from || undefined}
            title={handOverWords(over)}
            style={{
              left: `${left * 100}%`,
              width: `${(right - left) * 100}%`,
              top: Math.min(from, to),
              height: Math.abs(to - from),
            }}
          >
            {newest.get(over.to) === over && (
              <b data-side={right < 0.5 ? "right" : "left"}>{handOverTime(over)}</b>
            )}
          </i>
        );
      })}
    </li>
  );
}
