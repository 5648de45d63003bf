/** The live socket and the runner's address for React. */
import {
  createContext,
  type ReactNode,
  use,
  useEffect,
  useMemo,
  useRef,
  useState,
  useSyncExternalStore,
} from "react";
import { useConfig } from "../graphs";
import { errorText } from "../http";
import { LiveSocket, type LiveState } from "./live-socket";

interface LiveContext {
  live: LiveSocket | null;
  runner: string | undefined;
  /** Why the page does not know where the runner is; "" when it does. */
  lost: string;
}

const Context = createContext<LiveContext>({ live: null, runner: undefined, lost: "" });

/** Holds the page's one socket to the runner. `who` is who speaks: another name dials anew. */
export function LiveProvider({ who, children }: { who: string; children: ReactNode }) {
  const config = useConfig();
  const runner = config.data?.runner_url;
  const lost = config.isError ? errorText(config.error) : "";
  const [live, setLive] = useState<LiveSocket | null>(null);
  useEffect(() => {
    if (runner === undefined) return;
    const fresh = new LiveSocket(runner);
    fresh.open();
    setLive(fresh);
    return () => fresh.close();
  }, [runner]);
  const known = useRef(who);
  useEffect(() => {
    if (known.current === who) return;
    known.current = who;
    live?.redial();
  }, [who, live]);
  const hold = useMemo(() => ({ live, runner, lost }), [live, runner, lost]);
  return <Context value={hold}>{children}</Context>;
}

const NOTHING: LiveState = {
  link: "connecting",
  since: Date.now(),
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

export function useLive(): LiveContext & { now: LiveState } {
  const hold = use(Context);
  const { live, lost } = hold;
  const nothing = useMemo(() => unknown(lost), [lost]);
  const now = useSyncExternalStore(live?.subscribe ?? never, () => live?.state ?? nothing);
  return { ...hold, now };
}

/** When the engine itself last showed a run, ms; only who asks is rendered again each second. */
export function useRunSeenAt(run: string): number | undefined {
  const { live } = use(Context);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => live?.runSeenAt.get(run));
}

/** When a robot last answered, ms; an answer that changes nothing is told by a beat alone. */
export function useRobotAnsweredAt(robot: string): number | undefined {
  const { live } = use(Context);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => live?.robotAnsweredAt.get(robot));
}
