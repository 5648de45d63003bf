/**
 * Admission to a room: whether the server knows this browser as the person whose edits wait here.
 *
 * Asked before each attempt to enter a room, since a browser does not tell a page why an upgrade was
 * refused, and since somebody else may have signed in with another tab meanwhile: the edits of one
 * person never go under another's name.
 */

import { fetchJson, Refusal } from "../api/http";
import { currentPerson } from "../api/session";
import type { RefusalReason } from "./room-connection";

/** For `ConnectOptions.admit`. Throws `Unreachable` when nobody answers. */
export function admissionCheck(
  graph: string,
  person: string,
): (again: boolean) => Promise<RefusalReason | null> {
  return async (again) => {
    try {
      const here = await currentPerson();
      if (here.id !== person) return "other-person";
      if (again) await fetchJson(`/api/graphs/${encodeURIComponent(graph)}`);
      return null;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      const why = REASONS.get(error.details.status);
      if (why === undefined) throw error;
      return why;
    }
  };
}

const REASONS: ReadonlyMap<number, RefusalReason> = new Map([
  [401, "session-ended"],
  [403, "forbidden"],
  [404, "no-such-graph"],
  [410, "no-such-graph"],
]);
