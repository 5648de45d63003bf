/** A line with the values with which a run was started; nothing for a run without any. */
import type { Run } from "../api/run-stop";
import style from "./started-with.module.css";
import { valueLines } from "./value-words";

export function StartedWith({ run }: { run: Run }) {
  const lines = valueLines(run.values);
  if (lines.length === 0) return null;
  return (
    <ul className={style.values} aria-label="Started with" data-title="Started with">
      {lines.map(({ place, action, input, text }) => (
        <li key={place}>
          <bdi>{action}</bdi> <bdi>{input}</bdi> ={" "}
          <bdi className="ink mono" title={text}>
            {text}
          </bdi>
        </li>
      ))}
    </ul>
  );
}
