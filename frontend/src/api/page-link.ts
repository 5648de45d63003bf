/**
 * The page's one link to the runner: found and kept while somebody is signed in. It belongs to the page
 * and to no component, so that no error while something is drawn takes the way of Stop.
 */

import { useMemo, useSyncExternalStore } from "react";
import { tick } from "../clock/server-clock";
import { editor } from "./client";
import { errorText } from "./http";
import type { Live } from "./live-sites";
import { LiveSocket, type LiveState, stateOf } from "./live-socket";

export interface PageLinkState {
  live: Live | null;
  /** The runner's address, once the editor has told it. */
  runner: string | undefined;
  /**
   * The reason why the page does not know the runner's address; "" if it does, or has not asked
   * yet.
   */
  lost: string;
  /** Set if a person is signed in, as far as this page knows: only then STOP is shown. */
  signedIn: boolean;
}

const AGAIN = 5_000; // ms between two questions for the runner's address, at most

class PageLink {
  #state: PageLinkState = { live: null, runner: undefined, lost: "", signedIn: false };
  readonly #listeners = new Set<() => void>();
  /** Identity of the open socket: the runner knows it by the session it was opened with. */
  #who = "";
  #visit = 0;
  #asking = false;
  #makeLive: (runner: string) => Live = (runner) => new LiveSocket(runner);

  now = (): PageLinkState => this.#state;

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  /**
   * Says who is signed in. `visit` counts how often somebody signed in since the page was opened: a new
   * name or visit dials anew, since the socket is known by the old one.
   */
  enter(who: string, visit: number): void {
    const known = this.#state.signedIn && this.#who === who && visit <= this.#visit;
    this.#who = who;
    this.#visit = Math.max(visit, this.#visit);
    if (!this.#state.signedIn) this.#set({ signedIn: true });
    if (this.#state.live !== null) {
      if (!known) this.#state.live.redial();
    } else if (this.#state.runner !== undefined) this.#open(this.#state.runner);
    else void this.#find();
  }

  /** Says that nobody is signed in any more. */
  leave(): void {
    if (!this.#state.signedIn) return;
    this.#state.live?.close();
    this.#set({ live: null, signedIn: false });
  }

  #open(runner: string): void {
    const live = this.#makeLive(runner);
    live.open();
    this.#set({ live, runner, lost: "" });
  }

  /** Asks until the editor has told where the runner is: without that there is no way for Stop. */
  async #find(): Promise<void> {
    if (this.#asking) return;
    this.#asking = true;
    for (let wait = 500; this.#state.signedIn; wait = Math.min(AGAIN, 2 * wait)) {
      try {
        const { runner_url, runners = [] } = await editor.get("/api/config", {});
        if (runners.length > 1) {
          const { LiveSites } = await import("./live-sites");
          this.#makeLive = () => new LiveSites(runners);
        }
        if (this.#state.signedIn) this.#open(runner_url);
        else this.#set({ runner: runner_url });
        break;
      } catch (error) {
        this.#set({ lost: errorText(error) });
      }
      await new Promise((done) => setTimeout(done, wait));
    }
    this.#asking = false;
  }

  #set(part: Partial<PageLinkState>): void {
    this.#state = { ...this.#state, ...part };
    for (const listener of [...this.#listeners]) listener();
  }
}

export const pageLink = new PageLink();

const NOTHING: LiveState = {
  asked: [],
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

/** Return the state of the live link. `run`: the id of a run, for the state of its site instead of that of all sites. */
export function useLive(run?: string): PageLinkState & { now: LiveState } {
  const hold = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  const { live, lost } = hold;
  const nothing = useMemo(() => unknown(lost), [lost]);
  const now = useSyncExternalStore(live?.subscribe ?? never, () => live?.state ?? nothing);
  return { ...hold, now: stateOf(now, run) };
}

/**
 * Return when the engine last showed a run, by the server's clock; only callers are rendered again
 * each second.
 */
export function useRunSeenAt(run: string): number | undefined {
  const { live } = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => live?.runSeenAt.get(run));
}

/**
 * Return the oldest of the last answers of these robots, by the server's clock; undefined without
 * robots, and until each of them has answered.
 */
export function useOldestAnswerOf(robots: readonly string[]): number | undefined {
  const { live } = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => {
    const answers = robots.map((robot) => live?.robotAnsweredAt.get(robot) ?? Number.NaN);
    const oldest = Math.min(...answers);
    return Number.isFinite(oldest) ? oldest : undefined;
  });
}

/**
 * Return when a robot last answered, by the server's clock; answers without a change are counted
 * too.
 */
export function useRobotAnsweredAt(robot: string): number | undefined {
  const { live } = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  return useSyncExternalStore(live?.subscribeSeen ?? never, () => live?.robotAnsweredAt.get(robot));
}
