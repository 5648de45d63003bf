/** The problems that a merge would bring along. */
import { IconAlertTriangle } from "@tabler/icons-react";
import type { Problem } from "../api/graphs";
import style from "./drafts.module.css";

export function MergeProblems({ problems }: { problems: readonly Problem[] }) {
  if (problems.length === 0) return <p className={style.quiet}>No problem comes with it.</p>;
  return (
    <section aria-label="Problems that come with it">
      <h3>
        {problems.length === 1 ? "1 problem comes" : `${problems.length} problems come`} with it
      </h3>
      <ul className={style.problems}>
        {problems.map((problem) => (
          <li
            key={`${problem.code} ${problem.where.path} ${problem.message}`}
            data-severity={problem.severity}
          >
            <IconAlertTriangle size={14} aria-label={problem.severity} />
            <span>{problem.message}</span>
          </li>
        ))}
      </ul>
    </section>
  );
}
