/** The line in or below the bar of every page with the questions that runs ask now, and a link there. */
import { IconMessageQuestion } from "@tabler/icons-react";
import { Link, useLocation } from "wouter";
import { openRuns } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMayAnswer } from "../api/questions";
import { isolated } from "../words/isolated";
import style from "./asked-line.module.css";

/**
 * Shows the questions of runs to this person. `below`: the line has the width of the page, and is left out where the
 * question itself is.
 */
export function AskedLine({ below = false }: { below?: boolean }) {
  const [at] = useLocation();
  const { now, runner } = useLive();
  const asked = openRuns(now).flatMap((run) =>
    (run.questions ?? []).map((question) => ({ run, question })),
  );
  const known = useMayAnswer(
    runner,
    asked.map(({ run, question }) => ({ id: question.id, run: run.id })),
  );
  const mine = asked.filter(
    ({ run, question }) => !(below && at === `/runs/${run.id}`) && known(question.id)?.may,
  );
  const [first] = mine;
  if (first === undefined) return null;
  const { run, question } = first;
  const more = mine.length > 1 ? ` and ${mine.length - 1} more` : "";
  return (
    <span
      role="alert"
      className={style.alert}
      data-below={below || undefined}
      data-asked={!below || undefined}
    >
      <Link
        to={`/runs/${run.id}`}
        className={style.line}
        title={`Run ${run.number} asks: ${question.text}`}
        aria-label={`Run ${run.number} asks: ${isolated(question.text)}${more}`}
      >
        <IconMessageQuestion size={15} aria-hidden />
        <span className={style.words}>
          Asked: {question.text}
          {more}
        </span>
        {below && (
          <span className={style.answer} aria-hidden>
            Answer
          </span>
        )}
      </Link>
    </span>
  );
}
