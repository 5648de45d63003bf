/** Presses of what was looked at, other than a start: a press whose answer gets lost counts once with the next. */

import { notifications } from "@mantine/notifications";
import { errorText, isOutcomeUnknown } from "../../api/http";
import { sendPress } from "../../api/presses";
import type { StartOrder } from "../../api/runs";
import { type LookedAtOrder, notifyFailure } from "./use-start";

/** An error of a request whose outcome nobody knows: the message stays until a person closes it. */
class NotKnown extends Error {}

/** Return a name of a press of what was looked at: the same for the same. Digests stand for the graphs. */
export function pressOf(what: string, { umrf: _, inside, ...named }: LookedAtOrder): string {
  return `${what} ${JSON.stringify({ ...named, tree: inside?.tree_digest })}`;
}

/**
 * Send a press of what was looked at. If its answer gets lost, the next press of the same is sent with the same
 * request id, so that the two count once, and the error says that nobody knows.
 */
export function sendLookedAt<T>(
  what: string,
  order: LookedAtOrder,
  send: (order: StartOrder) => Promise<T>,
): Promise<T> {
  const press = sendPress(pressOf(what, order), (request) => send({ ...order, request }));
  return press.catch((error: unknown) => {
    throw isOutcomeUnknown(error) ? new NotKnown(errorText(error)) : error;
  });
}

/** Tell that a press came to nothing, or that nobody knows. `title`: for the first; `unknown`: what is not known. */
export function notifyPressFailure(error: unknown, title: string, unknown: string): void {
  if (error instanceof NotKnown) {
    const message = `${error.message} Another press of the same counts once.`;
    const head = `NOT KNOWN whether ${unknown}`;
    notifications.show({ color: "red", autoClose: false, title: head, message });
  } else notifyFailure(title, errorText(error));
}
