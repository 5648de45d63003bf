/**
 * The page's one link to the runner: found and kept while somebody is signed in. It belongs to the page
 * and to no component, so that no error while something is drawn takes the way of Stop.
 */

import { useSyncExternalStore } from "react";
import { editor } from "./client";
import { errorText } from "./http";
import { type LiveState, stateOf } from "./live-socket";
import { NOTHING, RunnerSockets } from "./runner-sockets";
import { identityOf, type Person } from "./session";
import type { Site } from "./sites";

export interface PageLinkState {
  live: RunnerSockets | null;
  /** The address that stands for all runners, once the page can send them requests. */
  runner: string | undefined;
  /**
   * Set if a person is signed in, as far as this page knows, or a Stop of one who was is not proven: only
   * then STOP is shown.
   */
  signedIn: boolean;
}

const LONGEST_PAUSE = 5_000; // ms between two tries to fetch where the runners are, at most
const REFRESH = 30_000; // ms after which a page that is looked at fetches it again: there may be others by now

class PageLink {
  #state: PageLinkState = { live: null, runner: undefined, signedIn: false };
  readonly #listeners = new Set<() => void>();
  /** Identity of the open socket: the runner knows it by the session it was opened with. */
  #who = "";
  /** Who signed in last: a STOP ALL that no runner has heard is theirs. */
  #person = { id: "", name: "" };
  #visit = 0;
  #sites: readonly Site[] = [];
  /** Whether the sites are being fetched, and whether what is fetched is out of date already. */
  #fetching: "no" | "yes" | "outdated" = "no";
  #refreshTimer: ReturnType<typeof setTimeout> | undefined;
  /** Ends the pause between two tries. */
  #endPause = () => {};
  /** Ends waiting for the proof of the Stops of somebody who has left. */
  #endWait = () => {};

  now = (): PageLinkState => this.#state;

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  /**
   * Says who is signed in. `visit` counts how often somebody signed in since the page was opened: a new
   * name or visit dials anew, since the socket is known by the old one. Nothing that another person has asked for is
   * sent in the name of this one.
   */
  enter(person: Person, visit: number): void {
    const who = identityOf(person);
    this.#endWait();
    const before = this.#person;
    this.#person = person;
    const known = this.#state.signedIn && this.#who === who && visit <= this.#visit;
    this.#who = who;
    this.#visit = Math.max(visit, this.#visit);
    if (this.#state.live !== null) {
      if (before.id !== person.id) this.#state.live.disown(before.name);
      if (!known) this.#state.live.redial();
      return;
    }
    const live = new RunnerSockets(this.refreshSites);
    if (this.#sites.length > 0) live.setSites(this.#sites);
    this.#set({ live, signedIn: true });
    this.refreshSites();
  }

  /**
   * Says that nobody is signed in any more. A Stop that is not proven is sent until it is heard, and shown: a
   * session that has expired still stops. Its proof is seen only once somebody signs in, if the session has ended.
   */
  leave(): void {
    this.#endWait();
    const { live } = this.#state;
    if (live === null) return;
    this.#who = "";
    if (live.isStopping) {
      this.#endWait = live.subscribe(() => {
        if (!live.isStopping) this.leave();
      });
      return;
    }
    live.close();
    this.#set({ live: null, signedIn: false });
  }

  /** Fetches where the runners are, until the editor has told it: without that there is no way for Stop. */
  refreshSites = (): void => {
    clearTimeout(this.#refreshTimer);
    if (this.#fetching === "no") return void this.#fetchUntilFound();
    this.#fetching = "outdated";
    this.#endPause();
  };

  async #fetchUntilFound(): Promise<void> {
    for (let pause = 500; this.#state.signedIn; pause = Math.min(LONGEST_PAUSE, 2 * pause)) {
      this.#fetching = "yes";
      try {
        await this.#fetchSites();
        if ((this.#fetching as string) === "outdated") continue;
        break;
      } catch (error) {
        this.#state.live?.setLost(errorText(error));
      }
      await new Promise<void>((done) => {
        this.#endPause = done;
        setTimeout(done, pause);
      });
    }
    this.#fetching = "no";
    if (this.#state.signedIn) this.#refreshLater();
  }

  #refreshLater(): void {
    const refresh = () => (document.hidden ? this.#refreshLater() : this.refreshSites());
    this.#refreshTimer = setTimeout(refresh, REFRESH);
  }

  async #fetchSites(): Promise<void> {
    const { runner_url: url, runners } = await editor.get("/api/config", {}).catch((error) => {
      throw new Error(`The runner’s address is not known. ${errorText(error)}`);
    });
    const sites = runners ?? [{ name: "", url }];
    if (!url || sites.length === 0 || sites.some((site) => !site.url))
      throw new Error("What the editor’s address answers does not say where the runners are.");
    this.#sites = sites;
    const { live } = this.#state;
    live?.setSites(this.#sites); // STOP waits for nothing that comes later
    if (live?.isApart === true) {
      const joiner = await import("./live-sites").then(
        ({ SitesJoiner }) => new SitesJoiner(),
        (error) => {
          const why = "A part of this page did not load. STOP goes to each runner.";
          throw new Error(`${why} ${errorText(error)}`);
        },
      );
      live.setJoiner(joiner);
    }
    if (this.#state.runner !== url) this.#set({ runner: url });
  }

  #set(part: Partial<PageLinkState>): void {
    this.#state = { ...this.#state, ...part };
    for (const listener of [...this.#listeners]) listener();
  }
}

export const pageLink = new PageLink();

const never = () => () => {};

/** Return the state of the live link. `run`: the id of a run; `now` is then the state of its site, not of all. */
export function useLive(run?: string): PageLinkState & { now: LiveState } {
  const hold = useSyncExternalStore(pageLink.subscribe, pageLink.now);
  const { live } = hold;
  const now = useSyncExternalStore(live?.subscribe ?? never, () => live?.state ?? NOTHING);
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
