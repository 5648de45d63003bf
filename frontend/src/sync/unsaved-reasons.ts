/** Says why edits are not saved, in sentences for people. */

import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import type { OtherPerson } from "./indexed-db";
import type { RefusalReason, RoomLink } from "./room-connection";

/** Returns why edits wait, or what is wrong with the room; null when everything is saved. */
export function unsavedReason(link: RoomLink): string | null {
  const edits = changes(link.unsaved);
  const keeps = link.unsaved === 0 ? "" : ` ${where(link)}`;
  switch (link.state) {
    case "live":
      if (link.readOnly !== undefined) return `${link.readOnly}${keeps}`;
      return link.unsaved === 0 ? null : `${edits} being sent to the server.`;
    case "refused":
      return `${refusals[link.why ?? "not-accepted"]}${keeps}`;
    case "connecting":
    case "offline": {
      const why = link.why === undefined ? "The server does not answer." : awaySentence(link);
      if (link.unsaved === 0) return link.state === "connecting" ? null : why;
      return `${why}${keeps} ${sentWhen(link.why)}`;
    }
  }
}

/** Returns whose edits wait on this device until they sign in again; null when there are none. */
export function otherPeopleWait(others: readonly OtherPerson[]): string | null {
  if (others.length === 0) return null;
  const parts = others.map(
    ({ name, waiting }) => `${changes(waiting)} of ${isolated(name || "a guest")}`,
  );
  const [only] = others;
  const one = others.length === 1 && only?.waiting === 1;
  return `${parts.join(" and ")} ${one ? "waits" : "wait"} on this device until they sign in again.`;
}

const refusals: Readonly<Record<RefusalReason, string>> = {
  "session-ended": "You are signed out.",
  "other-person": "Somebody else is signed in now, in this browser.",
  forbidden: "You may look at this graph, not change it.",
  "no-such-graph": "This graph is gone.",
  "other-epoch": "The server went back to an older state of this graph, from a backup perhaps.",
  "other-client": "This page is loaded again.",
  differs: "This page differed from the server and is loaded again.",
  full: "This graph is full: it may have 5,000 actions and 32 MiB. What you added last is put aside.",
  "not-accepted": "The server refused a change.",
  restarting: "The server restarts.",
  "too-slow": "The connection is too slow.",
  "no-network": "This device has no network.",
  proxy: "The proxy in front of the server cannot reach the server.",
  "not-stored": "The server cannot store anything at the moment.",
  "no-socket":
    "The server answers, but no live connection to it opens: a proxy in between may not pass WebSockets on.",
};

/** The words about a proxy say more than ours; those about a database are for owners. */
function awaySentence({ why, said }: RoomLink): string {
  if (why === "proxy" && said !== undefined) return said;
  return refusals[why ?? "no-socket"];
}

function sentWhen(why: RefusalReason | undefined): string {
  if (why === "not-stored") return "Sent when it can store again.";
  return why === "no-network"
    ? "Sent when the network is back."
    : "Sent when the server answers again.";
}

function where(link: RoomLink): string {
  const edits = changes(link.unsaved);
  const [wait, survive] = link.unsaved === 1 ? ["waits", "survives"] : ["wait", "survive"];
  return link.kept
    ? `${edits} ${wait} on this device and ${survive} closing the page.`
    : `${edits} ${wait} in this page only: keep it open.`;
}

function changes(n: number): string {
  return counted(n, "change");
}
