/** Questions that led runs ask people, and the answers. */
import { useQuery } from "@tanstack/react-query";
import { runnerAt } from "./client";
import { sendPress } from "./presses";
import type { Run } from "./run-stop";
import type { Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";
import { runnerOfRun } from "./site-places";
import { siteOfId } from "./sites";
import { useUnsaidSites } from "./unsaid-sites";

export type Question = RunnerApi["QuestionShown"];

/** The words of a person: an answer, or the reason why they cannot give one. */
export type Said = { readonly value: boolean | number | string } | { readonly cannot: string };

type MayAnswer = Pick<RunnerApi["WaitingQuestion"], "may" | "why">;

const ASK: MayAnswer = { may: true, why: "" };
const QUESTIONS = "/api/questions";

/**
 * Query whether this person may answer a question that waits, by its id; undefined until the runner has said it. Where
 * its runner does not say it, the answer itself is allowed or refused. `open`: the questions that the page knows, each
 * with the id of its run; the query is asked again when they change.
 */
export function useMayAnswer(
  runner: string | undefined,
  open: readonly { readonly id: string; readonly run: string }[],
): (id: string) => MayAnswer | undefined {
  const unsaid = useUnsaidSites(`get ${QUESTIONS}`);
  const { data, isError } = useQuery({
    queryKey: ["questions", runner, open.map(({ id }) => id).join(" ")],
    queryFn: ({ signal }) => runnerAt(runner).get(QUESTIONS, { signal }),
    enabled: runner !== undefined && open.length > 0,
    staleTime: 5_000,
    refetchInterval: 10_000, // batons and rights change
  });
  return (id) => {
    const at = siteOfId(open.find((each) => each.id === id)?.run ?? "");
    if (isError || unsaid.some(({ site }) => site.url === at?.url)) return ASK;
    return data?.questions.find(({ question }) => question.id === id);
  };
}

/** Answer a question. The first answer that is stored counts; robots may begin to move. */
export function answerQuestion(
  runner: string,
  run: string,
  question: string,
  said: Said,
  watching: Watching,
): Promise<Run> {
  return sendPress(`answer ${run} ${question} ${JSON.stringify(said)}`, (request) => {
    const body = { ...said, request_id: request, watching };
    const path = { run, question };
    return runnerAt(runner).post("/api/runs/{run}/questions/{question}/answer", { path, body });
  });
}

const PHOTO_MS = 60_000; // over the network of a hall

/** Send the photo for a question, and return its id, with which the question is answered. */
export async function sendPhoto(
  runner: string,
  run: string,
  question: string,
  photo: Blob,
): Promise<string> {
  const request = { path: { run, question }, body: photo, timeoutMs: PHOTO_MS };
  return (await runnerAt(runner).post("/api/runs/{run}/questions/{question}/photo", request)).photo;
}

/** The address of a photo that a person gave as an answer. */
export function photoUrl(runner: string, run: string, photo: string): string {
  return `${runnerOfRun(runner, run)}/api/runs/${encodeURIComponent(run)}/photos/${encodeURIComponent(photo)}`;
}
