/** A mark on a card or an arrow: how much is wrong, how much to fill in, and why as a tooltip. */
import { IconAlertTriangleFilled } from "@tabler/icons-react";
import { countWords } from "../graph/problems/problem-kinds";
import style from "./problem-badge.module.css";
import type { ProblemMark } from "./problem-marks";

export function ProblemBadge({ mark, on }: { mark: ProblemMark; on: "card" | "arrow" }) {
  const { wrong, fillIn, warnings } = mark;
  return (
    <span className={style.badges} data-on={on} title={mark.reasons}>
      <span aria-hidden className={style.badges}>
        {wrong > 0 && (
          <span className={style.badge} data-kind="wrong">
            {on === "card" ? `${wrong} wrong` : <IconAlertTriangleFilled size={10} />}
          </span>
        )}
        {fillIn > 0 && (
          <span className={style.badge} data-kind="fill-in">
            {fillIn}
          </span>
        )}
        {wrong === 0 && warnings > 0 && (
          <span className={style.badge} data-kind="warning">
            <IconAlertTriangleFilled size={10} /> {warnings}
          </span>
        )}
      </span>
      <span className="visually-hidden">
        {countWords(mark).join(", ")}. {mark.reasons}
      </span>
    </span>
  );
}
