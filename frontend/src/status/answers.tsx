/** Lists the answers of people in a run, with who gave them and when; nothing for a run that asked nobody. */
import { useLive } from "../api/page-link";
import { photoUrl } from "../api/questions";
import type { Run } from "../api/run-stop";
import type { RunnerApi } from "../api/schema/runner";
import { clock, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import { actionWords } from "./level-places";
import style from "./started-with.module.css";

type Answer = RunnerApi["AnswerShown"];

/** Return all answers of a run with their actions, in the order in which they were given. */
export function answersOf(run: Run): { action: string; answer: Answer }[] {
  return Object.entries(run.actions ?? {})
    .flatMap(([action, { visits }]) =>
      visits.flatMap(({ answered }) => (answered ? [{ action, answer: answered }] : [])),
    )
    .sort((a, b) => a.answer.at.localeCompare(b.answer.at));
}

/** Return an answer in words. */
export function answerWords({ value, reason }: Answer): string {
  if (value === undefined) return `could not answer: ${reason ?? ""}`;
  if (typeof value === "boolean") return value ? "yes" : "no";
  return String(value);
}

const PHOTO = /^[0-9a-f]{32}\.(jpg|png|webp)$/;

function Value({ run, answer }: { run: Run; answer: Answer }) {
  const { runner } = useLive();
  const { value } = answer;
  if (runner === undefined || typeof value !== "string" || !PHOTO.test(value))
    return (
      <bdi className="ink" title={answerWords(answer)}>
        {answerWords(answer)}
      </bdi>
    );
  return (
    <a href={photoUrl(runner, run.id, value)} target="_blank" rel="noreferrer">
      photo
    </a>
  );
}

export function Answers({ run }: { run: Run }) {
  const answers = answersOf(run);
  if (answers.length === 0) return null;
  return (
    <ul className={style.values} aria-label="Answered" data-title="Answered">
      {answers.map(({ action, answer }) => {
        const at = instant(answer.at);
        return (
          <li key={answer.question}>
            <bdi>{actionWords(run, action)}</bdi>: <Value run={run} answer={answer} />, by{" "}
            {isolated(answer.by.name || "somebody")}
            {at !== null && `, ${clock(at)}`}
          </li>
        );
      })}
    </ul>
  );
}
