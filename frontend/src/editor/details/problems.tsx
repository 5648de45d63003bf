/** What is wrong with the graph, what it would do, and where. */
import { IconCircleCheck } from "@tabler/icons-react";
import type { Problem, Problems } from "../../api/graphs";
import { type Bench, useBench } from "../bench";
import style from "./problems.module.css";

/** What on the canvas a problem is about: an action or a relation of the graph. */
export function placeOf(_bench: Bench, problem: Problem): string | null {
  return problem.where.relation ?? problem.where.aid ?? null;
}

function ProblemItem({ problem }: { problem: Problem }) {
  const bench = useBench();
  const place = placeOf(bench, problem);
  const jump = () => {
    if (place === null) return;
    bench.select([place]);
    bench.view.show(place.split(">").map((end) => end.split(";")[0] ?? end));
  };
  const severity = problem.severity === "error" ? "Error" : "Warning";
  return (
    <li className={style.problem} data-severity={problem.severity}>
      <div className={style.head}>
        <b className={style.code}>{problem.code}</b>
        <span className={style.severity}>{severity}</span>
        {place !== null && (
          <button type="button" className={style.jump} onClick={jump}>
            Show
          </button>
        )}
      </div>
      <p>{problem.message}</p>
      {problem.fix && <p className={style.fix}>{problem.fix}</p>}
    </li>
  );
}

interface Props {
  problems: Problems | undefined;
  seq: number;
}

export function ProblemList({ problems, seq }: Props) {
  if (!problems) return <p className={style.checked}>Checking …</p>;
  const order = [...problems.problems].sort((a, b) => a.severity.localeCompare(b.severity));
  return (
    <div className={style.list}>
      {order.length === 0 && (
        <p className={style.none}>
          <IconCircleCheck size={18} aria-hidden /> No problem found.
        </p>
      )}
      <ul>
        {order.map((problem, i) => (
          <ProblemItem
            key={`${problem.code} ${problem.where.path ?? ""} ${problem.where.relation ?? i}`}
            problem={problem}
          />
        ))}
      </ul>
      <p className={style.checked}>
        Checked at moment {problems.seq}
        {problems.seq < seq && `, now ${seq}: checking again …`}
      </p>
    </div>
  );
}
