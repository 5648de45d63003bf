/** A mark on a card or an arrow: how many problems, and why as a tooltip. */
import { IconAlertTriangleFilled } from "@tabler/icons-react";
import style from "./problem-badge.module.css";
import { countWords, type ProblemMark } from "./problem-marks";

export function ProblemBadge({ mark, on }: { mark: ProblemMark; on: "card" | "arrow" }) {
  const count = mark.error + mark.warning;
  return (
    <span
      className={style.badge}
      data-on={on}
      data-worst={mark.error > 0 ? "error" : "warning"}
      title={mark.reasons}
    >
      <IconAlertTriangleFilled size={10} aria-hidden />
      <span aria-hidden>{count}</span>
      <span className="visually-hidden">
        {countWords(mark)}. {mark.reasons}
      </span>
    </span>
  );
}
