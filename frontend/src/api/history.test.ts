/** The history is read again after an own edit, also while it is read for the first time. */
import { QueryClient, QueryObserver } from "@tanstack/react-query";
import { expect, test } from "vitest";
import { refreshHistory } from "./history";

test("an answer from before is given up, also the first of a moment", async () => {
  const client = new QueryClient();
  const answers: ((text: string) => void)[] = [];
  const observer = new QueryObserver(client, {
    queryKey: ["history", "g", 3],
    queryFn: ({ signal }) =>
      new Promise<string>((answer, fail) => {
        answers.push(answer);
        signal.addEventListener("abort", () => fail(signal.reason));
      }),
  });
  const leave = observer.subscribe(() => {});
  expect(answers).toHaveLength(1);

  const refreshed = refreshHistory(client, "g");
  await expect.poll(() => answers.length).toBe(2);
  answers[0]?.("changed it");
  answers[1]?.("went back");
  await refreshed;

  expect(observer.getCurrentResult().data).toBe("went back");
  leave();
});
