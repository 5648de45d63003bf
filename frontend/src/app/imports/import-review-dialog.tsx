/** Dialog that shows the translations in a file of an old dialect before it is kept. */
import { Button, Group, Modal, Text } from "@mantine/core";
import type { ProblemPlace } from "../../api/graphs";
import { problemGroups } from "../../graph/problems/problem-groups";
import { countsOf, countWords } from "../../graph/problems/problem-kinds";
import { useWatched } from "../../ui/watched";
import { counted } from "../../words/counted";
import { type ImportUnderReview, importReviews } from "./import-review";
import style from "./import-review-dialog.module.css";
import { dialectWords } from "./take-files";

const MOST_PROBLEMS = 8;

/** Shows the line of the file; for several places the first one. */
function Line({ where }: { where: ProblemPlace }) {
  return where.line === undefined ? null : <Text span c="dimmed">{` line ${where.line}`}</Text>;
}

function Problems({ waiting }: { waiting: ImportUnderReview }) {
  // That it is an old form is solved by keeping it.
  const left = waiting.preview.problems.filter(({ code }) => code !== "dialect-old");
  const problems = problemGroups(left, { actions: [], relations: [] });
  if (problems.length === 0) return null;
  const more = problems.length - MOST_PROBLEMS;
  return (
    <section className={style.part} aria-label="Problems">
      <h3>To look at afterwards: {countWords(countsOf(problems)).join(", ")}</h3>
      <ul className={style.problems}>
        {problems.slice(0, MOST_PROBLEMS).map((problem, i) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: the list never changes
          <li key={i} data-kind={problem.kind}>
            {problem.message}
            <Line where={problem.problems[0].where} /> <small>{problem.code}</small>
          </li>
        ))}
      </ul>
      {more > 0 && <Text c="dimmed">and {more} more</Text>}
    </section>
  );
}

function Body({ waiting }: { waiting: ImportUnderReview }) {
  const { preview, file } = waiting;
  const count = counted(preview.actions, "action");
  return (
    <>
      <Text>
        <b>{file}</b> is written in {dialectWords(preview.dialect)} ({preview.dialect}). It becomes{" "}
        <b>{preview.name || "Untitled"}</b> with {count}.
      </Text>
      <section className={style.part} aria-label="Translated">
        <h3>Translated</h3>
        {preview.remarks.length === 0 ? (
          <Text c="dimmed">Only the format; all values stay the same.</Text>
        ) : (
          <ul>
            {preview.remarks.map(({ message, where, times = 1 }) => (
              <li key={message}>
                {message}
                {times > 1 && ` (${times} times)`}
                <Line where={where} />
              </li>
            ))}
          </ul>
        )}
      </section>
      <Problems waiting={waiting} />
      <Group justify="flex-end" mt="md" className={style.answers ?? ""}>
        <Button onClick={() => waiting.answer(false)}>Cancel</Button>
        <Button variant="filled" data-autofocus onClick={() => waiting.answer(true)}>
          Keep
        </Button>
      </Group>
    </>
  );
}

export function ImportReviewDialog() {
  const waiting = useWatched(importReviews);
  return (
    <Modal
      opened={waiting !== null}
      onClose={() => waiting?.answer(false)}
      title="Look at what was translated"
      closeButtonProps={{ "aria-label": "Cancel the import" }}
      size="lg"
      centered
    >
      {waiting && <Body waiting={waiting} />}
    </Modal>
  );
}
