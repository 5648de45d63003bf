/** Requests about notes at moments of a run. Apart from those of `review.ts`, which the editor loads. */
import { useQuery } from "@tanstack/react-query";
import { runnerAt } from "./client";
import { sendPress } from "./presses";
import type { RunnerApi } from "./schema/runner";

/** A note that somebody wrote for a moment of a run. */
export type RunNote = RunnerApi["RunNote"];

export function useRunNotes(runner: string | undefined, run: string) {
  return useQuery({
    queryKey: notesKey(run),
    queryFn: ({ signal }) =>
      runnerAt(runner).get("/api/runs/{run}/notes", { path: { run }, signal }),
    enabled: runner !== undefined,
  });
}

/** The key of the query for the notes of a run. */
export const notesKey = (run: string) => ["runs", "notes", run] as const;

/**
 * Adds a note for a moment, and returns all notes of the run. `moment`: null for its end, or now. Where
 * the answer got lost, the same text sent again is the same note.
 */
export function addRunNote(
  runner: string,
  run: string,
  note: { readonly text: string; readonly moment: string | null },
): Promise<RunNote[]> {
  return sendPress(`note ${run} ${note.text}`, (request) => {
    const body = { ...note, request_id: request };
    return runnerAt(runner).post("/api/runs/{run}/notes", { path: { run }, body, keepalive: true });
  });
}
