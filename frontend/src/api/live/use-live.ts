/** The live socket and the runner's address for React. */

import { useMemo, useSyncExternalStore } from "react";
import { tick } from "../../clock/server-clock";
import type { LiveState } from "./live-socket";
import { type PageLinkState, pageLink } from "./page-link";

const NOTHING: LiveState = {
  link: "connecting",
  since: tick(),
  engines: [],
  runs: new Map(),
  stops: [],
};
const never = () => () => {};

/** Before the runner's address is known; with the reason, once there is one. */
const unknown = (lost: string): LiveState =>
  lost === ""
    ? NOTHING
    : {
        ...NOTHING,
        link: "down",
        unreached: { kind: "silent", why: `The runner’s address is not known. ${lost}` },
      };

export function useLive(): PageLinkState & { now: LiveState } {
  const hold = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  const { live, lost } = hold;
  const nothing = useMemo(() => unknown(lost), [lost]);
  const now = useSyncExternalStore(live?.subscribe ?? never, () => live?.state ?? nothing);
  return { ...hold, now };
}

/** When the engine itself last showed a run, by the server's clock; only who asks is rendered again each second. */
export function useRunSeenAt(run: string): number | undefined {
  const { live } = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => live?.runSeenAt.get(run));
}

/** When a robot last answered, by the server's clock; an answer that changes nothing is told by a beat alone. */
export function useRobotAnsweredAt(robot: string): number | undefined {
  const { live } = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => live?.robotAnsweredAt.get(robot));
}
