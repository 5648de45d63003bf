/**
 * The live sockets of all runners of the page behind one. STOP has this, and reaches each of them by it; what
 * joins the states of several (`live-sites.ts`) is loaded with several only, and may never come.
 */
import { deviceNow, tick } from "../clock/server-clock";
import { newAid } from "../graph/stop-basics";
import {
  disowned,
  foreignGraphs,
  isUnproven,
  isWaiting,
  LiveSocket,
  type LiveState,
  openRuns,
  type StopRequest,
  tellEach,
} from "./live-socket";
import { type Site, setSites } from "./sites";

export interface Part {
  /** The name by which the editor lists the site, or did last. */
  readonly listedAs: string;
  readonly site: Site;
  readonly socket: LiveSocket;
}

/** `pressedAt`: by the device's own clock; that of `tick` may stand still while the device sleeps. */
type Pressed = StopRequest & { readonly pressedAt: number };

type Times = Pick<LiveSocket, "runSeenAt" | "robotAnsweredAt">;

/** Joins what the sockets of several sites know, and knows which of them has what. */
export interface Joiner {
  join(parts: readonly Part[]): LiveState;
  joinTimes(parts: readonly Part[]): Times;
  /** Returns the sites that have a run or group; all while that is not known. */
  partsWith(run: string): readonly Part[];
  /** Returns the site that has a run, if that is known. */
  partWith(run: string): Part | undefined;
}

const LATE = 60_000; // ms in which a site of which the page hears gets an earlier STOP ALL as well

export const NOTHING: LiveState = {
  asked: [],
  link: "connecting",
  since: tick(),
  engines: [],
  runs: new Map(),
  stops: [],
};

const isRecent = ({ at, pressedAt }: Pressed) =>
  Math.max(tick() - at, deviceNow() - pressedAt) < LATE;

const unlisted = ({ listedAs, site, socket }: Part): Part => ({
  listedAs,
  site: { ...site, name: `${listedAs} (no longer listed)`, isUnlisted: true },
  socket,
});

/** Return the site of the same name, which is at another address. */
const movedTo = (left: Part, listed: readonly Part[]): Part | undefined =>
  listed.find(({ listedAs }) => listedAs === left.listedAs);

/**
 * Return whether the socket of a site that the editor does not name any more is still needed: something goes on
 * there, or a Stop is not proven. One that has moved is needed until its new address says what goes on, and not
 * where another runner has its address.
 */
function isNeeded(part: Part, listed: readonly Part[]): boolean {
  if (listed.some(({ site }) => site.url === part.site.url)) return false;
  const { state } = part.socket;
  if (movedTo(part, listed)?.socket.state.link === "live" && state.link !== "live") return false;
  if (state.stops.some(isUnproven)) return true;
  const goesOn = openRuns(state).length + foreignGraphs(state).length > 0;
  return goesOn || state.stops.some(isWaiting);
}

/** Usable without React: `subscribe` and `state` fit `useSyncExternalStore`. */
export class RunnerSockets implements Times {
  state = NOTHING;
  runSeenAt: ReadonlyMap<string, number> = new Map();
  robotAnsweredAt: ReadonlyMap<string, number> = new Map();
  #parts: readonly Part[] = [];
  #joiner: Joiner | undefined;
  /** Reason why what goes on is not known, apart from the reasons of the sockets. */
  #lost = "";
  /** Each STOP ALL, for sites of which the page hears later. */
  #pressed: readonly Pressed[] = [];
  readonly #listeners = new Set<() => void>();
  readonly #seers = new Set<() => void>();
  readonly #onStop: () => void;

  /** `onStop`: a Stop was sent to all sites that are known; there may be others by now. */
  constructor(onStop: () => void = () => {}) {
    this.#onStop = onStop;
  }

  /** Takes the runners as the editor names them, and keeps the sockets of those that it knew. */
  setSites(sites: readonly Site[]): void {
    const old = this.#parts;
    const hasMoved = ({ listedAs, site: { url } }: Part) =>
      sites.some((site) => site.name === listedAs && site.url !== url);
    const parts = sites.map((site, i): Part => {
      const known = old.find((part) => part.site.url === site.url && !hasMoved(part));
      if (known?.site.name === site.name) return known;
      const socket = known?.socket ?? new LiveSocket(site.url, i === 0);
      return { listedAs: site.name, site, socket };
    });
    if (parts.length === old.length && parts.every((part, i) => part === old[i])) return;
    const left = old.filter(({ socket }) => !parts.some((part) => part.socket === socket));
    const needed = left.filter((part) => isNeeded(part, parts));
    const gone = left.filter((part) => !needed.includes(part));
    const kept = needed.map(unlisted);
    this.#parts = [...parts, ...kept];
    setSites(this.#parts.length > 1 ? this.#parts.map(({ site }) => site) : []);
    const isFirst = old.length === 0;
    for (const { listedAs, socket } of parts) {
      if (old.some((part) => part.socket === socket)) continue;
      const late = this.#pressed.filter((stop) => isWaiting(stop) && (isFirst || isRecent(stop)));
      const moved = left.find((part) => part.listedAs === listedAs)?.socket.state.stops ?? [];
      const ids = new Map([...late, ...moved.filter(isWaiting)].map(({ id, run }) => [id, run]));
      tellEach(
        [...ids].map(
          ([id, run]) =>
            () =>
              socket.stop(run, id),
        ),
      );
      if (isFirst) {
        const stops = this.#pressed.filter((stop) => !isWaiting(stop));
        tellEach([() => socket.takeOver({ ...NOTHING, stops })]);
      }
      socket.subscribe(() => this.#hear());
      socket.subscribeSeen(() => this.#see());
      tellEach([() => socket.open()]);
    }
    for (const part of gone) {
      part.socket.close();
      tellEach([() => movedTo(part, parts)?.socket.takeOver(part.socket.state)]);
    }
    this.setLost("");
  }

  /** Takes what joins the states of several sites. */
  setJoiner(joiner: Joiner): void {
    this.#joiner = joiner;
    this.setLost("");
  }

  /** Whether there are several sockets, and nothing that joins what they know. */
  get isApart(): boolean {
    return this.#parts.length > 1 && this.#joiner === undefined;
  }

  /** Takes the reason why runners are not known, or not what goes on there; "" if that is known. */
  setLost(why: string): void {
    this.#lost = why;
    this.#hear();
  }

  /**
   * Whether a Stop is not answered or not proven at some runner, the last STOP ALL is refused, or it waits since no
   * runner is known yet.
   */
  get isStopping(): boolean {
    const last = this.#pressed.at(-1);
    const isDue = (stop: StopRequest) =>
      isWaiting(stop) ||
      isUnproven(stop) ||
      (stop.state === "refused" && stop.disownedPerson === undefined && stop.id === last?.id);
    if (this.#parts.length === 0) return last !== undefined && last.disownedPerson === undefined;
    return this.#parts.some(({ socket: { state } }) => state.stops.some(isDue));
  }

  close(): void {
    for (const { socket } of this.#parts) socket.close();
  }

  redial(): void {
    for (const { socket } of this.#parts) socket.redial();
  }

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  subscribeSeen = (seer: () => void): (() => void) => {
    this.#seers.add(seer);
    return () => this.#seers.delete(seer);
  };

  /**
   * Sends Stop of a run or group to its site, to all while it is not known which one has it. STOP ALL also goes
   * to each site of which the page hears a little later, as from an editor that did not answer.
   */
  stop(run: string | "all"): void {
    const id = newAid();
    const isOfOne = run !== "all" && this.#parts.length > 1;
    const having = isOfOne ? this.#joiner?.partsWith(run) : undefined;
    tellEach((having ?? this.#parts).map((part) => () => part.socket.stop(run, id)));
    if (run !== "all") return;
    const stop = { id, run, at: tick(), runs: [], state: "asked", detail: "" } as const;
    const pressedAt = deviceNow();
    this.#pressed = [...this.#pressed.slice(-4), { ...stop, pressedAt }];
    if (this.#parts.length === 0) this.#hear();
    this.#onStop();
  }

  /** Sends a STOP ALL no more that no runner has heard: its person, with this name, is not the one who is signed in. */
  disown(person: string): void {
    this.#pressed = this.#pressed.map((stop) => ({ ...stop, ...disowned(stop, person) }));
    for (const { socket } of this.#parts) socket.disown(person);
    this.#hear();
  }

  learn(run: Parameters<LiveSocket["learn"]>[0]): void {
    const [part, ...others] = this.#parts;
    const home = others.length === 0 ? part : this.#joiner?.partWith(run.id);
    home?.socket.learn(run); // of an unknown site it stays unknown to all
  }

  #hear(): void {
    this.state = this.#joined();
    tellEach(this.#listeners);
  }

  #see(): void {
    const [part, ...others] = this.#parts;
    const times = others.length === 0 ? part?.socket : this.#joiner?.joinTimes(this.#parts);
    this.runSeenAt = times?.runSeenAt ?? this.runSeenAt;
    this.robotAnsweredAt = times?.robotAnsweredAt ?? this.robotAnsweredAt;
    tellEach(this.#seers);
  }

  #joined(): LiveState {
    const [part, ...others] = this.#parts;
    if (part !== undefined && others.length === 0) return part.socket.state;
    if (part !== undefined && this.#joiner !== undefined) return this.#joiner.join(this.#parts);
    const lost = this.#lost !== "" && {
      link: "down" as const,
      unreached: { kind: part ? ("mute" as const) : ("silent" as const), why: this.#lost },
    };
    const sites = this.#parts.map(({ site, socket: { state } }) => ({ site, state }));
    const stops = part?.socket.state.stops ?? this.#pressed;
    return { ...NOTHING, ...lost, stops, ...(part && { sites }) };
  }
}
