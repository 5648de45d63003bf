/** Questions that led runs ask people, and the answers. */
import { useQuery } from "@tanstack/react-query";
import { runnerAt } from "./client";
import { sendPress } from "./presses";
import type { Run } from "./run-stop";
import type { Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";
import { runnerOfRun } from "./sites";

export type Question = RunnerApi["QuestionShown"];

/** The words of a person: an answer, or the reason why they cannot give one. */
export type Said = { readonly value: boolean | number | string } | { readonly cannot: string };

/**
 * Query whether this person may answer each question that waits, by its id; null if the runner does not say. `open`:
 * the ids of those that the page knows; the query is asked again when they change.
 */
export function useMayAnswer(
  runner: string | undefined,
  open: readonly string[],
): ReadonlyMap<string, RunnerApi["WaitingQuestion"]> | null {
  const { data, isError } = useQuery({
    queryKey: ["questions", runner, open.join(" ")],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/questions", { signal }),
    enabled: runner !== undefined && open.length > 0,
    staleTime: 5_000,
    refetchInterval: 10_000, // batons and rights change
  });
  if (isError) return null;
  return new Map((data?.questions ?? []).map((each) => [each.question.id, each]));
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
