/** Confirming who one is, where a robot or an owner's action asks for it again. */
import { editor, runnerAt } from "./client";
import type { RunnerApi } from "./schema/runner";

/** A request of another device of this person, which this page can answer. */
export type AskedConfirmation = RunnerApi["ConfirmationShown"];
type Asked = RunnerApi["ConfirmationAsked"];

const LOOK = 1_000; // ms between two questions whether another device has answered

/**
 * Asks the other devices of this person, and waits for the answer of one of them. `onWaiting` gets the
 * request, with the number that both devices show. Returns whether the answer was yes. Throws `Refusal`
 * when nobody has answered in time. `signal` withdraws the request.
 */
export async function confirmByDevice(
  runner: string,
  robots: readonly string[],
  onWaiting: (asked: Asked) => void,
  signal: AbortSignal,
): Promise<boolean> {
  const at = runnerAt(runner);
  let asked = await at.post("/api/confirmations", { body: { robots } });
  const path = { request_id: asked.id };
  const cancel = () =>
    void at.delete("/api/confirmations/{request_id}", { path, keepalive: true }).catch(() => {});
  signal.addEventListener("abort", cancel, { once: true });
  while (asked.state === "waiting") {
    onWaiting(asked);
    await new Promise((done) => setTimeout(done, LOOK));
    signal.throwIfAborted();
    asked = await at.get("/api/confirmations/{request_id}", { path, signal });
  }
  signal.removeEventListener("abort", cancel);
  if (asked.record != null) await editor.post("/api/confirmations/records", { body: asked.record });
  return asked.state === "confirmed";
}

export async function answerConfirmation(
  runner: string,
  request: string,
  yes: boolean,
): Promise<void> {
  await runnerAt(runner).post("/api/confirmations/{request_id}/answer", {
    path: { request_id: request },
    body: { yes },
  });
}

/** Brings the last confirmation of this session from the editor to the runner, which may have a data
 * folder of its own. Returns its seal; "" if there was none. */
export async function bringConfirmation(runner: string): Promise<string> {
  const { last } = await editor.get("/api/confirmations/mine", {});
  if (last == null) return "";
  await runnerAt(runner).post("/api/confirmations/records", { body: last });
  return last.seal;
}
